// The page without this reads and answers all the same: every control is a link or a form. This changes
// pages in place, so that one slider goes through a run, and listens to single keys. It judges nothing.
"use strict";
const root = document.documentElement;
root.classList.add("scripts");
let visit = 0;

// Shows another page in place of this one; `sent` is a form's answer that has led to it.
async function show(url, { sent = null, push = true } = {}) {
  const mine = ++visit;
  const answer = await (sent ?? fetch(url, { headers: { Accept: "text/html" } }));
  if (!(answer.headers.get("Content-Type") ?? "").startsWith("text/html")) {
    // A refusal is a line of text.
    refuse((await answer.text()).trim());
    return;
  }
  // What is read again by itself is no answer to it.
  if (push) refuse("");
  const next = new DOMParser().parseFromString(await answer.text(), "text/html");
  const main = next.getElementById("main");
  const pictures = [...main.querySelectorAll("img")].map((picture) => picture.decode().catch(() => {}));
  await Promise.race([Promise.all(pictures), new Promise((done) => setTimeout(done, 400))]);
  // Whoever has gone on meanwhile is not called back.
  if (mine !== visit) return;
  const old = document.getElementById("main");
  const focused = document.activeElement?.id;
  const open = new Set([...old.querySelectorAll("details[id][open]")].map((details) => details.id));
  const there = new URL(answer.url);
  there.hash = new URL(url, location.href).hash;
  if (push && there.href !== location.href) history.pushState(null, "", there);
  document.title = next.title;
  document.querySelector("header").replaceWith(next.querySelector("header"));
  old.replaceWith(main);
  for (const id of open) document.getElementById(id)?.setAttribute("open", "");
  const wanted = there.hash && document.getElementById(there.hash.slice(1));
  if (wanted) {
    wanted.focus();
    wanted.scrollIntoView({ block: "nearest" });
  } else if (focused) {
    (document.getElementById(focused) ?? main).focus({ preventScroll: true });
  }
  say(main.dataset.says);
  settle();
}

function say(words) {
  document.getElementById("says").textContent = words;
}

// Says why a form was not done, where it is seen and heard; nothing takes it away again.
function refuse(words) {
  const line = document.getElementById("refused");
  line.hidden = !words;
  line.textContent = words;
}

// After a page has come: the lit node in view, the next pictures on their way.
function settle() {
  const lit = document.querySelector(".graph .lit");
  const frame = lit?.closest(".graph");
  if (frame) {
    const [box, edge] = [lit.getBoundingClientRect(), frame.getBoundingClientRect()];
    frame.scrollLeft += box.left + box.width / 2 - (edge.left + edge.width / 2);
    frame.scrollTop += box.top + box.height / 2 - (edge.top + edge.height / 2);
  }
  for (const url of document.getElementById("main").dataset.soon.split(" ").filter(Boolean)) new Image().src = url;
}

function isHere(url) {
  return url.origin === location.origin && !url.pathname.startsWith("/api/");
}

addEventListener("click", (event) => {
  const link = event.target.closest?.("a[href]");
  if (!link || event.defaultPrevented || event.button !== 0 || event.metaKey || event.ctrlKey || event.shiftKey) return;
  const url = new URL(link.href);
  const isBelow = url.pathname === location.pathname && url.search === location.search && url.hash;
  if (isHere(url) && !isBelow) {
    event.preventDefault();
    show(link.href);
  }
});

addEventListener("submit", (event) => {
  const form = event.target;
  if (form.method !== "post") return;
  event.preventDefault();
  const body = new URLSearchParams(new FormData(form, event.submitter));
  const buttons = form.querySelectorAll("button:not(:disabled)");
  for (const button of buttons) button.disabled = true;
  // A form that was refused is there still.
  show(form.action, { sent: fetch(form.action, { method: "POST", body }) }).finally(() => {
    for (const button of buttons) button.disabled = false;
  });
});

addEventListener("input", (event) => {
  if (event.target.id !== "slider") return;
  const { run, numbers } = event.target.dataset;
  const at = Number(event.target.value);
  show(`${run}/${numbers.split(" ")[at >> 1]}/${at % 2 ? "after" : "before"}`);
});

// A speed is set by choosing it.
addEventListener("change", (event) => {
  if (event.target.id === "percent") event.target.form.requestSubmit();
});

addEventListener("popstate", () => show(location.href, { push: false }));

// Single keys, unless they are turned off or something is being typed.
const keys = document.getElementById("keys");
keys.checked = localStorage.getItem("keys") !== "off";
keys.addEventListener("change", () => localStorage.setItem("keys", keys.checked ? "on" : "off"));
addEventListener("keydown", (event) => {
  if (!keys.checked || event.metaKey || event.ctrlKey || event.altKey || event.repeat) return;
  if (event.target.matches?.("input:not([type=range]):not([type=checkbox]), select, textarea")) return;
  // Enter on a control is that control's own.
  if (event.key === "Enter" && event.target.matches?.("a, button, summary, input")) return;
  const arrows = { ArrowLeft: "#previous", ArrowRight: "#following" };
  let wanted = null;
  if (event.key in arrows && event.target.id !== "slider") wanted = document.querySelector(`a${arrows[event.key]}`);
  else if (event.key === "h") wanted = document.querySelector("details.hint:not([open]) > summary");
  else wanted = document.querySelector(`[data-key="${CSS.escape(event.key)}"]:not(:disabled)`);
  if (wanted) {
    event.preventDefault();
    wanted.click();
  }
});

// A live run: look again when it has changed. One question at a time, and none while a page is on its way.
let asking = false;
setInterval(async () => {
  const main = document.getElementById("main");
  if (asking || main.dataset.live === undefined) return;
  asking = true;
  const before = visit;
  try {
    const now = await (await fetch("/live.json")).json();
    if (before === visit && String(now.version) !== main.dataset.live) await show(location.href, { push: false });
  } catch {
    say("the program does not answer any more");
  } finally {
    asking = false;
  }
}, 500);

// A run that is looked at: its state several times a second, and pictures when they are there.
let looking = false;
async function look() {
  const state = document.getElementById("watched");
  if (looking || !state || state.dataset.over) return;
  looking = true;
  try {
    const answer = await fetch(`/watch/state?after=${state.dataset.version}`);
    if (answer.status !== 200) return;
    const text = await answer.text();
    const next = new DOMParser().parseFromString(text, "text/html").getElementById("watched");
    const pictures = [...next.querySelectorAll("img")];
    for (const whose of ["real", "twin"]) {
      const old = document.getElementById(`watch-${whose}`);
      const url = next.dataset[whose];
      if (!url || old.getAttribute("src") === url) continue;
      const picture = old.cloneNode();
      picture.src = url;
      pictures.push(picture);
    }
    await Promise.all(pictures.map((picture) => picture.decode().catch(() => {})));
    document.getElementById("task").textContent = next.dataset.task;
    for (const picture of pictures.filter((picture) => picture.id)) document.getElementById(picture.id).replaceWith(picture);
    if (next.dataset.ended) await keepReport(next);
    if (next.dataset.ended && !state.dataset.ended) say("the run is over");
    state.replaceWith(next);
    // The program may end once it has heard that the end is here.
    if (next.dataset.over) await fetch(`/watch/state?after=${next.dataset.version}`);
  } catch {
    if (!document.getElementById("watched").dataset.over) say("the program does not answer any more");
  } finally {
    looking = false;
  }
}
setInterval(look, 120);

// The report outlives the program that served it.
async function keepReport(state) {
  const link = state.querySelector("#report");
  if (!link) return;
  const page = await (await fetch(link.href)).blob();
  link.href = URL.createObjectURL(page);
}

settle();
