//! A render by several processes has the bits of one by a single process. Threads stand for
//! processes here.

use super::*;
use phalanx::integrate::{Alone, Team, together};
use std::sync::mpsc::{Receiver, Sender, channel};

/// Sends to each, and receives from each.
struct Member {
    rank: usize,
    to: Vec<Sender<Vec<u8>>>,
    from: Vec<Mutex<Receiver<Vec<u8>>>>,
}

impl Team for Member {
    fn rank(&self) -> usize {
        self.rank
    }
    fn size(&self) -> usize {
        self.to.len()
    }
    fn send(&self, to: usize, bytes: &[u8]) {
        self.to[to].send(bytes.to_vec()).unwrap();
    }
    fn receive(&self, from: usize) -> Vec<u8> {
        self.from[from].lock().unwrap().recv().unwrap()
    }
}

fn team(size: usize) -> Vec<Member> {
    let mut members: Vec<Member> = (0..size)
        .map(|rank| Member {
            rank,
            to: Vec::new(),
            from: Vec::new(),
        })
        .collect();
    for from in 0..size {
        for to in 0..size {
            let (sender, receiver) = channel();
            members[from].to.push(sender);
            members[to].from.push(Mutex::new(receiver));
        }
    }
    members
}

/// The render of a team of so many, each of which watches by an observer of its own.
fn by_team<O: Observer>(
    scene: &Scene,
    settings: &Settings,
    state: Option<&State>,
    observers: &[O],
) -> Render {
    let members = team(observers.len());
    let renders: Vec<Option<Render>> = std::thread::scope(|scope| {
        let each = members.iter().zip(observers).map(|(member, observer)| {
            scope.spawn(move || {
                let mut settings = settings.clone();
                settings.threads = 1 + member.rank % 2;
                let lanes = [Width::Eight, Width::One];
                settings.lanes = lanes[usize::from(member.rank == 1)];
                together(scene, &settings, state, observer, member).unwrap()
            })
        });
        let each: Vec<_> = each.collect();
        each.into_iter()
            .map(|render| render.join().unwrap())
            .collect()
    });
    assert_eq!(renders.iter().flatten().count(), 1);
    renders.into_iter().next().unwrap().unwrap()
}

/// Teams of so many; stopped by the last of them, gone on with by others.
fn expect_together(scene: &Scene, settings: &Settings, sizes: &[usize]) {
    let whole = render(scene, settings, &Silent).unwrap();
    for &size in sizes {
        let name = format!("{} by {size}", settings.integrator.name());
        let silent: Vec<Silent> = (0..size).map(|_| Silent).collect();
        let all = by_team(scene, settings, None, &silent);
        assert!(all.stats.gathered.unwrap().bytes > 0);
        expect_same(&whole, &all, &name);
        // The last one stops them all; the first one has the state.
        let stops = |rank| Stopped::after(if rank + 1 == size { 1 } else { u32::MAX });
        let mut stopped: Vec<Stopped> = (0..size).map(stops).collect();
        let part = by_team(scene, settings, None, &stopped);
        let state = stopped.swap_remove(0).state();
        let alone = resume(scene, settings, &state, &Silent).unwrap();
        expect_same(&whole, &alone, &name);
        if part.ended_by == EndedBy::Observer {
            let others: Vec<Silent> = (1..size).map(|_| Silent).collect();
            let resumed = by_team(scene, settings, Some(&state), &others);
            expect_same(&whole, &resumed, &name);
        }
    }
}

#[test]
fn chains() {
    let scene = scene();
    for integrator in [
        IntegratorKind::Mmlt,
        IntegratorKind::Pssmlt(PathSamplerKind::Pt),
    ] {
        let mut settings = settings(&scene, integrator);
        settings.mutations_per_pixel = 40;
        expect_together(&scene, &settings, &[2, 3, 4]);
    }
}

#[test]
fn samples() {
    let scene = scene();
    for integrator in [IntegratorKind::Pt, IntegratorKind::Bdpt] {
        let mut settings = settings(&scene, integrator);
        settings.samples_per_pixel = 40;
        expect_together(&scene, &settings, &[2, 5]);
    }
}

#[test]
fn samples_and_chains() {
    let text = include_str!("../../../scenes/slit.pbrt");
    let mut slit = load_str(text, "slit.pbrt", Path::new("")).unwrap();
    slit.set_resolution(56, 56).unwrap();
    let mut settings = settings(&slit, IntegratorKind::Auto);
    settings.mutations_per_pixel = 300;
    settings.bootstrap = 65_536;
    settings.chains = 4096;
    settings.seed = 1;
    let both = together(&slit, &settings, None, &Silent, &Alone).unwrap();
    let stats = both.unwrap().stats;
    assert!(stats.mutations > 0 && stats.samples > 0);
    expect_together(&slit, &settings, &[3]);
    // Samples alone.
    let scene = scene();
    settings.mutations_per_pixel = 100;
    expect_together(&scene, &settings, &[2]);
}

/// A picture of one pixel, which is all that a film has room for.
#[test]
fn a_single_pixel() {
    let mut scene = scene();
    scene.set_resolution(1, 1).unwrap();
    let mut settings = settings(&scene, IntegratorKind::Mmlt);
    settings.mutations_per_pixel = 20_000;
    expect_together(&scene, &settings, &[2]);
}

/// The error that ends a render is that of the whole picture, and time is up for all at once.
#[test]
fn all_end_together() {
    let text = r#"
LookAt 0 0 5  0 0 0  0 1 0
Camera "perspective" "float fov" 40
Film "image" "integer xresolution" 16 "integer yresolution" 16
WorldBegin
LightSource "infinite" "rgb L" [1 1 1]
Shape "sphere"
WorldEnd
"#;
    let scene = load_str(text, "sphere.pbrt", Path::new("")).unwrap();
    let silent = [Silent, Silent, Silent];
    for integrator in [IntegratorKind::Mmlt, IntegratorKind::Bdpt] {
        let mut settings = settings(&scene, integrator);
        settings.mutations_per_pixel = u64::from(u32::MAX);
        settings.samples_per_pixel = u64::from(u32::MAX);
        settings.target_error = Some(0.2);
        let by_error = by_team(&scene, &settings, None, &silent);
        assert_eq!(by_error.ended_by, EndedBy::Target);
        assert!(by_error.stats.relative_error.unwrap() <= 0.2);
        settings.target_error = None;
        settings.time = Some(std::time::Duration::from_millis(300));
        let by_time = by_team(&scene, &settings, None, &silent);
        assert_eq!(by_time.ended_by, EndedBy::Time);
    }
}

/// What cannot be rendered is refused by the first, and the others leave.
#[test]
fn failures_end_all() {
    let scene = scene();
    let mut settings = settings(&scene, IntegratorKind::Mmlt);
    let keeps = Stopped::after(1);
    render(&scene, &settings, &keeps).unwrap();
    let state = keeps.state();
    settings.seed += 1;
    let members = team(3);
    let refused = std::thread::scope(|scope| {
        let each = members.iter().map(|member| {
            let (scene, settings, state) = (&scene, &settings, &state);
            scope.spawn(move || together(scene, settings, Some(state), &Silent, member))
        });
        let each: Vec<_> = each.collect();
        let ends = each.into_iter().map(|end| end.join().unwrap());
        ends.map(|end| end.is_err()).collect::<Vec<bool>>()
    });
    assert_eq!(refused, [true, false, false]);
}
