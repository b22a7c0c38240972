"""A server of masks to copy: `python examples/masks_server.py [SAM_CHECKPOINT.pth]`, then
`trueup camera segment photo.png --box 450,250,640,480 --masks http://127.0.0.1:8000/masks`.
With a checkpoint segment-anything answers (pip install segment-anything torch), without one OpenCV's GrabCut (pip install
opencv-python-headless). What is asked and answered: docs/seeing.md, "Masks from elsewhere"."""
import base64, json, sys
from http.server import BaseHTTPRequestHandler, HTTPServer

import cv2
import numpy as np

if len(sys.argv) > 1:
    from segment_anything import SamPredictor, sam_model_registry
    name = next(kind for kind in ("vit_h", "vit_l", "vit_b") if kind in sys.argv[1])
    sam = SamPredictor(sam_model_registry[name](checkpoint=sys.argv[1]))

def by_sam(prompt):
    box = np.array(prompt["box"]) if "box" in prompt else None
    point = np.array([prompt["point"]]) if "point" in prompt else None
    label = None if point is None else np.array([1])
    masks, scores, _ = sam.predict(point_coords=point, point_labels=label, box=box)
    return zip(masks, scores)  # three masks: a part, a whole, and what it belongs to

def by_grabcut(image, prompt):
    h, w = image.shape[:2]
    u, v = prompt.get("point", (0, 0))
    x0, y0, x1, y1 = prompt.get("box", (u - h / 6, v - h / 6, u + h / 6, v + h / 6))  # a point: a box around it
    x0, y0, x1, y1 = (int(round(c)) for c in (max(x0, 0), max(y0, 0), min(x1, w - 1), min(y1, h - 1)))
    labels = np.zeros((h, w), np.uint8)
    cv2.grabCut(image, labels, (x0, y0, x1 - x0, y1 - y0), np.zeros((1, 65)), np.zeros((1, 65)), 5, cv2.GC_INIT_WITH_RECT)
    return [((labels == cv2.GC_FGD) | (labels == cv2.GC_PR_FGD), 0.5)]

class Masks(BaseHTTPRequestHandler):
    def do_POST(self):
        asked = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        image = cv2.imdecode(np.frombuffer(base64.b64decode(asked["image"]["base64"]), np.uint8), cv2.IMREAD_COLOR)
        if len(sys.argv) > 1:
            sam.set_image(cv2.cvtColor(image, cv2.COLOR_BGR2RGB))
        masks = []
        for k, prompt in enumerate(asked["prompts"]):  # none: everything that stands out is asked for, which this one skips
            for mask, score in by_sam(prompt) if len(sys.argv) > 1 else by_grabcut(image, prompt):
                png = base64.b64encode(cv2.imencode(".png", mask.astype(np.uint8) * 255)[1]).decode()
                masks.append({"prompt": k, "score": float(score), "png": png})
        answer = json.dumps({"masks": masks}).encode()
        self.send_response(200)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(answer)))
        self.end_headers()
        self.wfile.write(answer)

HTTPServer(("127.0.0.1", 8000), Masks).serve_forever()
