// SPDX-License-Identifier: Apache-2.0
//! A client with six degrees of freedom: pulls the hand to a point with a spring, turns the handle upright, and opens
//! the gripper half. While button 0 is pressed, the point follows the hand. This file has socket, clock, signals and
//! physics.

mod aead;
mod noise;
mod opening;
mod protobuf;
mod schema;
mod session;
#[cfg(test)]
mod vectors;

use std::net::{SocketAddr, ToSocketAddrs, UdpSocket};
use std::os::raw::c_int;
use std::os::unix::fs::PermissionsExt;
use std::process::exit;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use opening::{Attempt, Outcome, Welcome};
use protobuf::{Node, Writer};
use session::{Event, Session, CODE_OK};

const NAME: &str = "spring";
const CODE_BUSY: i128 = 4;
const CODE_SHUTDOWN: i128 = 6;
const CODE_REPLACED: i128 = 9;
const DESCRIBE: u32 = 4;
const STIFFNESS_NPM: f64 = 300.0;
const ANGULAR_STIFFNESS_NMPRAD: f64 = 0.1;
const ANGULAR_DAMPING_NMSPRAD: f64 = 0.001;
const GRIP_STIFFNESS_NPRAD: f64 = 4.0;
const VALID_FOR_US: u64 = 20_000;
const FIRST_PAUSE_NS: i64 = 100_000_000;
const LONGEST_PAUSE_NS: i64 = 2_000_000_000;

static END: AtomicBool = AtomicBool::new(false);

extern "C" {
    fn signal(number: c_int, handler: extern "C" fn(c_int)) -> usize;
}

extern "C" fn on_signal(_: c_int) {
    END.store(true, Ordering::SeqCst);
}

/// The remote environment: a function of the state and the server's description of the handle.
#[derive(Default)]
struct Spring {
    sequence: u64,
    point_m: [f64; 3],
    max_force_n: f64,
    max_torque_nm: Option<f64>,
    gripper_open_rad: Option<f64>,
    max_gripper_force_n: Option<f64>,
}

/// Limits the length of a vector. Returns true if it was longer.
fn shorten<const N: usize>(vector: &mut [f64; N], most: f64) -> bool {
    let length = vector.iter().map(|part| part * part).sum::<f64>().sqrt();
    if length <= most {
        return false;
    }
    // The margin covers rounding, which could exceed the limit.
    vector.iter_mut().for_each(|part| *part *= most * (1.0 - 1e-12) / length);
    true
}

impl Spring {
    fn describe_handle(&mut self, handle: &Node) {
        self.max_torque_nm = Some(handle.real(5));
        self.gripper_open_rad = handle.has(6).then(|| handle.real(6));
        self.max_gripper_force_n = Some(handle.real(7));
    }

    fn answer(&mut self, state: &Node, welcome: &Welcome) -> Vec<u8> {
        let position: [f64; 3] = state.sub(3).map(Node::reals).unwrap_or_default();
        if state.whole(17) & 1 == 1 {
            self.point_m = position;
        }
        let mut force = [0.0; 3];
        for (i, part) in force.iter_mut().enumerate() {
            *part = -STIFFNESS_NPM * (position[i] - self.point_m[i]);
        }
        let limited = shorten(&mut force, self.max_force_n);
        self.sequence += 1;
        let mut command = Writer::default();
        command.whole(1, self.sequence);
        command.whole(2, state.whole(1) as u64);
        command.reals(3, &force);
        if welcome.local_model {
            let mut model = Writer::default();
            model.reals(1, &position);
            model.packed(2, &[if limited { 0.0 } else { STIFFNESS_NPM }]);
            command.bytes(4, &model.0);
        }
        command.whole(5, VALID_FOR_US);
        if welcome.handle {
            self.answer_turn(state, &mut command);
        }
        command.0
    }

    /// Torque, grip force and the torque's model, each only if the device has motors for it.
    fn answer_turn(&self, state: &Node, command: &mut Writer) {
        let orientation = state.sub(15).map(Node::reals::<4>);
        let mut model = None;
        if let (Some(at), true) = (orientation, state.has(18)) {
            let [w, x, y, z] = at;
            let speed: [f64; 3] = state.sub(16).map(Node::reals).unwrap_or_default();
            // The rotation from upright is the orientation itself, so this is the gradient of 2 vᵀ K v (WIRE.md).
            let mut torque = [x, y, z].map(|part| -2.0 * ANGULAR_STIFFNESS_NMPRAD * w * part);
            for (part, speed) in torque.iter_mut().zip(speed) {
                *part -= ANGULAR_DAMPING_NMSPRAD * speed;
            }
            let limited = shorten(&mut torque, self.max_torque_nm.unwrap_or(ANGULAR_STIFFNESS_NMPRAD));
            command.reals(10, &torque);
            model = Some((at, if limited { 0.0 } else { ANGULAR_STIFFNESS_NMPRAD }));
        }
        if state.has(19) && state.has(21) {
            let half_rad = self.gripper_open_rad.unwrap_or(0.0) / 2.0;
            let mut grip = [GRIP_STIFFNESS_NPRAD * (half_rad - state.real(19))];
            shorten(&mut grip, self.max_gripper_force_n.unwrap_or(1.0));
            command.present_real(11, grip[0]);
        }
        if let Some((at, stiffness)) = model {
            let mut turn = Writer::default();
            turn.reals(1, &at);
            turn.packed(2, &[stiffness]);
            command.bytes(14, &turn.0);
        }
    }
}

/// Summary of a session, printed at its end.
#[derive(Debug, Default)]
struct Seen {
    states: u64,
    presses: u32,
    buttons: u32,
    largest_force_n: f64,
    largest_torque_nm: f64,
    fastest_turn_radps: f64,
    largest_turn_rad: f64,
    largest_grip_force_n: f64,
    widest_gripper_rad: f64,
    largest_hand_force_n: f64,
}

fn length(vector: Option<&Node>) -> f64 {
    vector.map_or(0.0, |vector| vector.reals::<3>().iter().map(|part| part * part).sum::<f64>().sqrt())
}

impl Seen {
    fn note(&mut self, state: &Node) {
        let buttons = state.whole(17) as u32;
        self.states += 1;
        self.presses += (buttons & !self.buttons).count_ones();
        self.buttons = buttons;
        let largest = |largest: &mut f64, value: f64| *largest = largest.max(value);
        largest(&mut self.largest_force_n, length(state.sub(5)));
        largest(&mut self.largest_torque_nm, length(state.sub(18)));
        largest(&mut self.fastest_turn_radps, length(state.sub(16)));
        largest(&mut self.largest_hand_force_n, length(state.sub(22)));
        largest(&mut self.largest_grip_force_n, state.real(21).abs());
        largest(&mut self.widest_gripper_rad, state.real(19));
        if let Some([w, ..]) = state.sub(15).map(Node::reals::<4>) {
            largest(&mut self.largest_turn_rad, 2.0 * w.abs().min(1.0).acos());
        }
    }
}

enum Phase {
    Pause(i64),
    Opening(Attempt),
    Open(Box<Session>, Welcome),
}

struct Client {
    socket: UdpSocket,
    start: Instant,
    key: Option<noise::Key>,
    controls: bool,
    phase: Phase,
    pause_ns: i64,
    spring: Spring,
    seen: Seen,
    handle_request: Option<u32>,
}

impl Client {
    fn now_ns(&self) -> i64 {
        self.start.elapsed().as_nanos() as i64
    }

    /// An error means that an earlier datagram met a closed port or that a queue is full. Treats it as a loss.
    fn send(&self, bytes: &[u8]) {
        let _ = self.socket.send(bytes);
    }

    fn attempt(&mut self) {
        self.phase = Phase::Opening(Attempt::new(self.controls, NAME, self.key.as_ref(), self.now_ns()));
    }

    fn pause(&mut self) {
        self.phase = Phase::Pause(self.now_ns() + self.pause_ns);
        self.pause_ns = (2 * self.pause_ns).min(LONGEST_PAUSE_NS);
    }

    fn welcome(&mut self, welcome: Welcome, random: [u8; 16]) {
        let now_ns = self.now_ns();
        eprintln!("welcome to {:?}, force up to {} N", welcome.device_name, welcome.max_force_n);
        self.spring = Spring { max_force_n: welcome.max_force_n, ..Spring::default() };
        self.seen = Seen::default();
        self.pause_ns = FIRST_PAUSE_NS;
        let mut session = Session::new(&welcome, Some(random), now_ns);
        session.request(DESCRIBE, &[], now_ns);
        self.handle_request = None;
        if welcome.handle {
            let mut describe = Writer::default();
            describe.whole(2, 1);
            self.handle_request = session.request(DESCRIBE, &describe.0, now_ns);
        }
        self.phase = Phase::Open(Box::new(session), welcome);
    }

    fn receive(&mut self, bytes: &[u8]) {
        let now_ns = self.now_ns();
        match &mut self.phase {
            Phase::Pause(_) => {}
            Phase::Open(session, _) => session.receive(bytes, now_ns),
            Phase::Opening(attempt) => match attempt.receive(bytes, now_ns) {
                Outcome::Nothing => {}
                Outcome::Welcome(welcome) => {
                    let random = attempt.random;
                    self.welcome(welcome, random);
                }
                Outcome::Refused { code, detail } => {
                    eprintln!("refused with code {}: {}", code, detail);
                    if code != CODE_BUSY && code != CODE_SHUTDOWN {
                        exit(1);
                    }
                    self.pause();
                }
            },
        }
    }

    /// Handles the session's events. Returns the code if the session has ended.
    fn take_events(&mut self) -> Option<i128> {
        let (session, welcome) = match &mut self.phase {
            Phase::Open(session, welcome) => (session, welcome),
            _ => return None,
        };
        while let Some(event) = session.event() {
            match event {
                Event::State(state) => {
                    self.seen.note(&state);
                    if welcome.controls && state.whole(12) == 0 {
                        let force = self.spring.answer(&state, welcome);
                        if !session.send_force(force) {
                            eprintln!("a force with a number out of bounds is not sent");
                        }
                    }
                }
                Event::Answer(id, answer) => match (answer.sub(5), answer.sub(6)) {
                    (Some(device), _) => eprintln!("the device: {:?}, {}", device.text(2), device.text(3)),
                    (_, Some(handle)) if Some(id) == self.handle_request && answer.whole(2) == CODE_OK => {
                        self.spring.describe_handle(handle);
                        eprintln!("the handle: torque up to {} N·m, {} buttons", handle.real(5), handle.all(3).len());
                    }
                    _ => eprintln!("request {} is answered with code {}: {}", id, answer.whole(2), answer.text(3)),
                },
                Event::Report(report) => {
                    if !report.text(20).is_empty() {
                        eprintln!("the server says: {}", report.text(20));
                    }
                }
                Event::Closed { code, reason } => {
                    eprintln!("the session is over, code {}: {}; {:?}", code, reason, session.counters);
                    return Some(code);
                }
            }
        }
        None
    }

    /// Sends what is due and returns the time of the next call.
    fn advance(&mut self) -> i64 {
        let now_ns = self.now_ns();
        match &mut self.phase {
            Phase::Pause(until_ns) => {
                let until_ns = *until_ns;
                if now_ns >= until_ns {
                    self.attempt();
                    return now_ns;
                }
                until_ns
            }
            Phase::Opening(attempt) => {
                let hello = attempt.next(now_ns);
                let due_ns = attempt.due_ns;
                if let Some(hello) = hello {
                    self.send(&hello);
                }
                due_ns
            }
            Phase::Open(session, _) => {
                let mut written = session.tick(now_ns);
                while let Some(datagram) = session.next(now_ns) {
                    written.push(datagram);
                }
                let wake_ns = session.wake_ns();
                written.iter().for_each(|datagram| self.send(datagram));
                wake_ns
            }
        }
    }

    fn run(&mut self) {
        let mut buffer = [0; 2048];
        self.attempt();
        while !END.load(Ordering::SeqCst) {
            // Answers a state before reading the next one.
            if let Some(code) = self.take_events() {
                if code == CODE_REPLACED {
                    exit(1);
                }
                self.pause();
            }
            let wake_ns = self.advance();
            let wait_ns = (wake_ns - self.now_ns()).clamp(1_000, 20_000_000) as u64;
            self.socket.set_read_timeout(Some(Duration::from_nanos(wait_ns))).expect("a socket can wait");
            if let Ok(length) = self.socket.recv(&mut buffer) {
                self.receive(&buffer[..length]);
            }
        }
        eprintln!("{:?}", self.seen);
        let now_ns = self.now_ns();
        if let Phase::Open(session, _) = &mut self.phase {
            let byes = session.close(CODE_OK, "the program ends", now_ns);
            eprintln!("{:?}", session.counters);
            byes.iter().for_each(|bye| self.send(bye));
        }
    }
}

fn usage(why: &str) -> ! {
    eprintln!("{}\nUsage: spring --server ADDRESS:PORT [--key FILE] [--observer]", why);
    exit(2);
}

fn load_key(path: &str) -> Result<(bool, noise::Key), String> {
    let mode = std::fs::metadata(path).map_err(|error| error.to_string())?.permissions().mode();
    if mode & 0o077 != 0 {
        return Err("others than its owner may read it".to_string());
    }
    noise::read_key(&std::fs::read_to_string(path).map_err(|error| error.to_string())?).map_err(str::to_string)
}

fn main() {
    noise::start();
    let (mut server, mut key, mut controls) = (None, None, true);
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        match word.as_str() {
            "--server" => server = words.next(),
            "--key" => {
                let path = words.next().unwrap_or_else(|| usage("--key needs a file"));
                let (observes, bytes) = load_key(&path).unwrap_or_else(|why| usage(&format!("{}: {}", path, why)));
                controls &= !observes;
                key = Some(bytes);
            }
            "--observer" => controls = false,
            _ => usage(&format!("unknown: {}", word)),
        }
    }
    let server = server.unwrap_or_else(|| usage("a server is needed"));
    let address: SocketAddr = match server.to_socket_addrs().map(|mut all| all.next()) {
        Ok(Some(address)) => address,
        _ => usage("no such server"),
    };
    if key.is_none() && !address.ip().is_loopback() {
        usage("without a key only servers on this machine can be talked to");
    }
    let local: SocketAddr = if address.is_ipv4() { ([0, 0, 0, 0], 0).into() } else { ([0u16; 8], 0).into() };
    let socket = UdpSocket::bind(local).expect("a socket");
    socket.connect(address).expect("a way to the server");
    unsafe {
        signal(15, on_signal);
        signal(2, on_signal);
    }
    let mut client = Client {
        socket,
        start: Instant::now(),
        key,
        controls,
        phase: Phase::Pause(0),
        pause_ns: FIRST_PAUSE_NS,
        spring: Spring::default(),
        seen: Seen::default(),
        handle_request: None,
    };
    client.run();
}
