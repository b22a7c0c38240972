//! Tables of measured numbers: clocks that stray, columns without end, values that are none.

use std::fmt::Write as _;

use super::{Bench, ENDS, REFUSED, WRONG};

/// A recording of seven joints that swing alike, `n` rows. `row` makes each of its number, time and angle: a time,
/// an angle and a torque; what is not these three stands as it is.
fn swinging(n: usize, row: impl Fn(usize, f64, f64) -> String) -> Vec<u8> {
    let mut text = String::from("t[s]");
    (1..=7).for_each(|joint| _ = write!(text, ",q_{joint}[rad]"));
    (1..=7).for_each(|joint| _ = write!(text, ",tau_{joint}[N*m]"));
    for k in 0..n {
        let t = k as f64 * 0.01;
        let row = row(k, t, (3.0 * t).sin());
        text.push('\n');
        match row.split(',').collect::<Vec<_>>()[..] {
            [t, q, tau] => {
                text += t;
                for value in [q, tau] {
                    text += &format!(",{value}").repeat(7);
                }
            }
            _ => text += &row,
        }
    }
    text.into_bytes()
}

fn plain(t: f64, q: f64) -> String {
    format!("{t},{q},{}", 2.0 * q)
}

fn recordings() -> Vec<Vec<u8>> {
    let text = |text: &str| text.as_bytes().to_vec();
    let stray = |at: usize, value: &'static str| {
        swinging(400, move |k, t, q| if k == at { format!("{value},{q},0") } else { plain(t, q) })
    };
    let later = |by: f64| swinging(400, move |k, t, q| plain(if k > 200 { t + by } else { t }, q));
    let wide = |n: usize| {
        let mut text = String::from("t[s]");
        (0..n).for_each(|k| _ = write!(text, ",q_{}[rad]", k + 1));
        (0..4).for_each(|k| _ = write!(text, "\n{k}{}", ",0".repeat(n)));
        text.into_bytes()
    };
    let header = "t[s],q_1[rad],tau_1[N*m]\n";
    vec![
        stray(200, "1e9"),
        stray(200, "1e300"),
        stray(200, "-1e300"),
        stray(0, "1e18"),
        stray(399, "1e18"),
        stray(200, "nan"),
        stray(200, "inf"),
        stray(200, ""),
        stray(200, "noon"),
        later(86_400.0),
        later(1e12),
        swinging(2000, |k, t, q| plain(if k % 2 == 0 { 0.0 } else { t }, q)),
        swinging(2000, |k, _, q| plain((k % 3) as f64, q)),
        swinging(2000, |_, t, q| plain(-t, q)),
        swinging(2000, |_, _, q| plain(0.0, q)),
        swinging(400, |k, t, q| plain(if k < 2 { t } else { t * 1e-15 }, q)),
        swinging(400, |_, t, q| format!("{t},{},0", q * 1e308)),
        swinging(400, |_, t, _| format!("{t},nan,nan")),
        swinging(400, |_, t, _| format!("{t},inf,-inf")),
        swinging(400, |_, t, _| format!("{t},,")),
        swinging(400, |k, t, q| if k == 9 { plain(t, q) + ",9,9,9" } else { plain(t, q) }),
        swinging(400, |k, t, q| if k == 9 { t.to_string() } else { plain(t, q) }),
        swinging(1, |_, t, q| plain(t, q)),
        swinging(2, |_, t, q| plain(t, q)),
        wide(20_000),
        wide(100_000),
        text(""),
        text("\n\n\n"),
        text(header),
        text("t[s],q_1[rad],q_1[rad]\n0,1,2\n1,2,3\n"),
        text("q_1[rad],tau_1[N*m]\n0,1\n1,2\n"),
        text("t[parsec],q_1[furlong]\n0,1\n1,2\n"),
        text("t[s],q_0[rad],q_99999999999999999999[rad]\n0,1,2\n1,2,3\n"),
        text("t[s],\x1b[2J[rad],tau_\x07[N*m]\n0,1,2\n1,2,3\n"),
        text("t[s],\"q_1[rad]\n0,1,2\n1,2,3\n"),
        b"t[s],q_\xff[rad]\n0,1\n".to_vec(),
        [header.as_bytes(), &[0; 4096]].concat(),
        format!("{header}0,{},1\n", "9".repeat(4 << 20)).into_bytes(),
        format!("t[s],{}\n0,1\n", "q".repeat(4 << 20)).into_bytes(),
    ]
}

fn sidecars() -> Vec<Vec<u8>> {
    let text = |text: &str| text.as_bytes().to_vec();
    vec![
        text("{"),
        text("[]"),
        text("{\"robot\": \"../../../../dev/zero\"}"),
        text("{\"robot\": \"/dev/zero\"}"),
        text("{\"noise\": {\"q_rad\": -1, \"tau_nm\": [1e308, -1e308]}}"),
        text("{\"segments\": [{\"name\": \"a\", \"from_s\": 3, \"to_s\": -3}]}"),
        text(
            "{\"controller\": {\"type\": \"pd_with_gravity\", \"kp_nm_per_rad\": [], \"kd_nm_s_per_rad\": []}}",
        ),
        text("{\"encoder_step_rad\": -1e-5, \"gravity_m_s2\": 1e308}"),
        format!("{{\"robot\": {}1{}}}", "[".repeat(100_000), "]".repeat(100_000)).into_bytes(),
    ]
}

#[test]
fn recordings_are_read_or_refused() {
    let mut bench = Bench::new("recordings");
    for recording in recordings() {
        bench.case(&[("r.csv", &recording)], &["gap", "r.csv"], ENDS);
    }
    let good = swinging(400, |_, t, q| plain(t, q));
    for sidecar in sidecars() {
        bench.case(&[("r.csv", &good), ("r.json", &sidecar)], &["gap", "r.csv"], ENDS);
    }
    for holdout in ["nan", "-1", "2", "1e300"] {
        bench.case(&[("r.csv", &good)], &["gap", "r.csv", "--holdout", holdout], REFUSED);
    }
    for map in ["=", "q_1", "q_1=q_1[x", "a=b,a=c,a=d", "t=t[s],t=t[h]"] {
        bench.case(&[("r.csv", &good)], &["gap", "r.csv", "--map", map], ENDS);
    }
    bench.end(55);
}

#[test]
fn pairs_and_points_are_read_or_refused() {
    let mut bench = Bench::new("pairs");
    let rows =
        |header: &str, row: &str, n: usize| format!("{header}\n{}", row.repeat(n)).into_bytes();
    let map = "u_x[px],u_y[px],v_x[px],v_y[px]";
    let points = "x[m],y[m],z[m],u[px],v[px],view";
    let offset = "xs[m],ys[m],zs[m],xr[m],yr[m],zr[m]";
    for row in ["1,2,3,4\n", "nan,nan,nan,nan\n", "1e308,1e308,-1e308,0\n", "1,2\n", "a,b,c,d\n"] {
        let pairs = rows(map, row, 50);
        bench.case(&[("p.csv", &pairs)], &["align", "map", "p.csv", "--model", "auto"], ENDS);
    }
    for row in
        ["0,0,0,1,1,a\n", "inf,0,0,1,1,a\n", "1e300,1e300,0,1e300,1,a\n", "0,0,0,1,1,\x1b[2J\n"]
    {
        let table = rows(points, row, 50);
        bench.case(&[("p.csv", &table)], &["align", "intrinsics", "p.csv"], WRONG);
        bench.case(&[("p.csv", &table)], &["gap", "p.csv"], ENDS);
    }
    for row in ["0,0,0,0,0,0\n", "nan,0,0,0,0,0\n", "1e308,0,0,-1e308,0,0\n"] {
        let table = rows(offset, row, 50);
        bench.case(&[("p.csv", &table)], &["align", "offset", "p.csv", "--model", "auto"], ENDS);
    }
    bench.end(16);
}

/// A bag whose one chunk is two gigabytes of zeros, in a few hundred kilobytes.
fn bomb() -> Vec<u8> {
    let mut file = std::io::Cursor::new(Vec::new());
    let options = mcap::WriteOptions::new()
        .chunk_size(Some(4 << 30))
        .compression(Some(mcap::Compression::Zstd));
    let mut writer = options.create(&mut file).unwrap();
    let schema = writer.add_schema("sensor_msgs/msg/JointState", "ros2msg", b"").unwrap();
    let more = std::collections::BTreeMap::new();
    let channel = writer.add_channel(schema, "/joint_states", "cdr", &more).unwrap();
    let zeros = vec![0; 4 << 20];
    for sequence in 0..512 {
        let time = u64::from(sequence) * 1_000_000;
        let header = mcap::records::MessageHeader {
            channel_id: channel,
            sequence,
            log_time: time,
            publish_time: time,
        };
        writer.write_to_known_channel(&header, &zeros).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    file.into_inner()
}

#[test]
fn bags_are_read_or_refused() {
    let mut bench = Bench::new("bags");
    let bomb = bomb();
    let half = &bomb[..bomb.len() / 2];
    let magic = &bomb[..8];
    let long = [magic, &[6], &u64::MAX.to_le_bytes(), &[0; 64]].concat();
    let mut spoilt = bomb.clone();
    spoilt.iter_mut().skip(40).step_by(97).for_each(|byte| *byte ^= 0x5a);
    for bag in [&bomb, half, magic, &long, &spoilt, b"", b"no bag at all".as_slice()] {
        bench.case(&[("r.mcap", bag)], &["gap", "r.mcap"], REFUSED);
    }
    bench.end(7);
}
