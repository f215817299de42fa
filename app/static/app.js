// The page, put together: core/ talks to the server, ui/ shows and asks, this file joins them.

import { api } from "./core/api.js";
import { followClip } from "./core/captions.js";
import { CameraFeed } from "./core/camera-feed.js";
import { Describer } from "./core/describer.js";
import { FrameSender } from "./core/frame-sender.js";
import { GalleryKeeper } from "./core/galleries.js";
import { GamepadReader } from "./core/gamepad.js";
import { Held } from "./core/held.js";
import { inspection } from "./core/inspection.js";
import { Stills } from "./core/jpeg.js";
import { Latency } from "./core/latency.js";
import { memory } from "./core/memory.js";
import { changesFor, INITIAL_STATE } from "./core/messages.js";
import { OperatorLink } from "./core/operator-link.js";
import { PictureReport } from "./core/picture-report.js";
import { SourceKeeper } from "./core/source-keeper.js";
import { ServerClock } from "./core/server-clock.js";
import { ticket } from "./core/sign-in.js";
import { SettingsKeeper } from "./core/settings.js";
import { Stopper } from "./core/stopper.js";
import { Store } from "./core/store.js";
import { texts, told, toldError } from "./texts/texts.js";
import { Opening } from "./opening.js";
import { Control } from "./ui/control.js";
import { setHidden, setText } from "./ui/dom.js";
import { dockButtons, steps, stopButton } from "./ui/dock.js";
import { gestureList } from "./ui/gesture-list.js";
import { glassFold } from "./ui/glass-fold.js";
import { connection, driver, goneOverlay, statePill } from "./ui/header.js";
import { keys } from "./ui/keys.js";
import { latencyBar } from "./ui/latency-bar.js";
import { Notices } from "./ui/notices.js";
import { operatorView } from "./ui/operator-view.js";
import { isDriving, keepRootClasses, preparePage } from "./ui/page.js";
import { askingNotice } from "./ui/people.js";
import { readout } from "./ui/readout.js";
import { sentence } from "./ui/sentence.js";
import { goneContent, helpContent, Sheets } from "./ui/sheets.js";
import { knownSpeed, safeSpeed, speed, speedOf } from "./ui/speed.js";
import { stage } from "./ui/stage.js";
import { Starting } from "./ui/starting.js";
import { whoseBar } from "./ui/whose-bar.js";
import { describeError } from "./ui/words.js";

const byId = (id) => document.getElementById(id);

preparePage(document);
const store = new Store(INITIAL_STATE);
const link = new OperatorLink();
const galleries = new GalleryKeeper(link, api, store, memory);
const settings = new SettingsKeeper(api, store, memory);
const robotId = () => {
    const robot = store.state.hello && store.state.hello.robot;
    return robot && typeof robot === "object" ? robot.id : robot || null;
};
const stopper = new Stopper(link, api, robotId);
const clock = new ServerClock(link);
const latency = new Latency(clock);
const when = (tick) => clock.when(tick);
const feeds = { wrist: new CameraFeed("wrist", when), scene: new CameraFeed("scene", when) };
const held = new Held(link);
const describer = new Describer(api, store);
const pictures = new PictureReport(
    link,
    feeds,
    () => isDriving(store.state),
    (camera, shown) => latency.picture(camera, shown),
);
let jog = { down: () => false, up: () => {}, pad: () => {} }; // until somebody drives by keys
const counts = { hello: 0, frame: 0, gesture: 0, robot: 0, gallery: 0, pong: 0, error: 0 };
let lastError = null;

// What is shown

const root = document.documentElement;
const sheets = new Sheets(byId("sheets"), ["gone", "asking", "notices", "dock"].map(byId));
const notices = new Notices(byId("notices"));
const control = new Control(link, store, sheets, notices);
askingNotice(byId("asking"), store);
keepRootClasses(root, store);
statePill(byId("state-pill"), store);
driver(byId("driver"), store);
connection(byId("connection"), store);
goneOverlay(byId("gone"), store, (kind, why) => goneContent(kind, why, () => link.retryNow()), byId("main"));
steps(byId("steps"), store);
dockButtons(byId("dock-buttons"), store);
stopButton(byId("stop"), store);
store.set({ speed: knownSpeed(memory.get("speed")), fine: memory.get("fine") === "yes" });
speed(byId("dock-speed"), store);
sentence(byId("sentence"), byId("sentence-spoken"), store);
const video = operatorView(byId("operator"), store);
store.set({ glass: memory.get("glass") === "open" });
glassFold(byId("glass"), store, { templateUrl: api.templateUrl });
gestureList(byId("gestures"), store, { templateUrl: api.templateUrl });
readout(byId("readout"), store);
const pressed = keys(root, {
    closeSheet: () => sheets.close(),
    canMove: () => Boolean(store.state.robot && store.state.robot.armed),
    jog: { down: (event) => jog.down(event), up: (event) => jog.up(event) },
});
const views = stage(byId("stage"), store, { feeds, onFrame: pressed.listen, memory: settings, ticket });
const reading = () => latency.reading(performance.now(), byId("stage").dataset.large);
latencyBar(byId("stage"), reading);

const sender = new FrameSender(link, video);
followClip(api, store, video);
const source = new SourceKeeper(video, store, sender);
let stills = null;
const starting = new Starting({
    host: root,
    sheets,
    store,
    memory,
    video,
    source,
    galleries,
    templateUrl: api.templateUrl,
    act: {
        takeControl: () => control.take(),
        disarm: () => link.send("disarm"),
        take: () => (stills ||= new Stills()).take(video),
        check: (pictures, sign) => api.checkGesture(pictures, store.state.gallery, { sign }),
        save: (gesture, pictures) => api.replaceSamples(gesture.id, pictures),
        told: (text) => notices.show(text, { kind: "good", name: "first" }),
    },
});
whoseBar(byId("whose"), store);
galleries.addEventListener("lost", () => notices.show(texts.first.whose.lost, { kind: "bad", name: "whose" }));

// Who drives by keys

let jogAsked = false;
const byKeys = () => store.state.source.kind === "keys";

async function loadJog() {
    jogAsked = true;
    const { jogPad } = await import("./ui/jog.js");
    jog = jogPad(byId("jog"), store, {
        held,
        mayPress: () => !sheets.name,
        stop: () => wishes.stop(),
    });
    new GamepadReader(byKeys, (wanted) => jog.pad(wanted));
}

store.watch(["connection", "hello", "robot", "source"], (state) => {
    setHidden(byId("jog"), !byKeys());
    setText(byId("operator-title"), byKeys() ? texts.jog.title : texts.headings.operator);
    if (byKeys() && !jogAsked) loadJog();
    if (byKeys() && isDriving(state)) held.start();
    else held.stop();
});
// A key that goes up while another window has the focus is never heard of.
window.addEventListener("blur", () => held.release());
document.addEventListener("visibilitychange", () => held.release());

// Sheets and notices end where the dock begins, however tall its words make it.
new ResizeObserver(([entry]) => {
    const height = entry.borderBoxSize[0].blockSize;
    root.style.setProperty("--dock-height", `${Math.ceil(height)}px`);
}).observe(byId("dock"), { box: "border-box" });

// What the server says

let hadSession = false;
let signInCheck = 0;
const CLOSED_TRIES = 3; // REST answers and the WebSocket never opened: that has a cause here
let closedTries = 0;

link.addEventListener("state", async ({ detail }) => {
    if (detail.state === "open") sendView();
    if (detail.state !== "open") {
        sender.forget();
        latency.forget();
    }
    if (detail.state === "waiting") {
        // A browser does not say why a WebSocket was refused; REST does.
        const check = ++signInCheck;
        let answered = false;
        try {
            await api.robots();
            answered = true;
        } catch (error) {
            if (error.status === 401 && check === signInCheck && !link.isOpen) {
                store.set({ connection: { state: "signed-out" } });
                return;
            }
        }
        if (check !== signInCheck || link.isOpen) return;
        if (answered && !hadSession && ++closedTries === CLOSED_TRIES) opening.preflight();
        if (store.state.connection.state === "signed-out") return;
    }
    if (detail.state === "connecting" && store.state.connection.state !== "open") {
        // Trying again is no news: the words stay until the connection does something.
        if (store.state.hello) return;
    }
    // "open" only once the server has said hello
    if (detail.state === "open") return;
    store.set({
        connection: detail,
        robot: null,
        frame: null,
        detail: null,
        gesture: null,
        wasArmed: false,
    });
});

link.addEventListener("message", ({ detail: message }) => {
    if (message.type in counts) counts[message.type] += 1;
    const changes = changesFor(message, store.state, performance.now());
    if (changes) store.set(changes);
    if (message.type === "hello") greeted();
    else if (message.type === "robot") {
        stopper.saw(message);
        latency.robot(message, isDriving(store.state), performance.now());
        control.robotSpoke(message.online);
        describer.ask(robotId());
    } else if (message.type === "frame") {
        latency.frame(message, sender.answered(message.seq), performance.now());
        const { width, height } = sender;
        const { frameSize } = store.state;
        if (frameSize.width !== width || frameSize.height !== height) {
            store.set({ frameSize: { width, height } });
        }
    } else if (message.type === "gallery") {
        tellProblem(message.problem);
        galleries.heard(message);
    } else if (message.type === "error") refused(message);
});

function greeted() {
    store.set({ connection: { state: "open" } });
    sendSpeed();
    pictures.restart();
    control.greeted();
    if (hadSession) notices.show(texts.notices.reconnected, { name: "reconnected" });
    hadSession = true;
    describer.restart();
    describer.ask(robotId());
    tellProblem(store.state.hello.problem);
    galleries.greeted();
    // Somebody pressed STOP and nobody heard: say it again, first of all.
    if (stopper.state === "failed") stopper.stop();
    for (const feed of Object.values(feeds)) feed.retryNow();
}

function refused(message) {
    lastError = message;
    if (galleries.refused(message)) return;
    if (message.code === "control_kept") control.refused();
    if (Number.isFinite(message.seq) && message.seq !== null) {
        sender.answered(message.seq);
        return; // a single frame; the next one comes at once
    }
    if (message.message) notices.show(toldError(message), { kind: "bad", name: message.code });
}

/** What is wrong with the gestures stays on the page for as long as it keeps the robot disarmed. */
function tellProblem(problem) {
    if (problem) notices.show(told(problem), { kind: "bad", name: "gestures", stay: true });
    else notices.clear("gestures");
}

/** Masks and distances cost the server a little, the glass box more: only while somebody looks. */
function sendView() {
    const detail = document.visibilityState !== "hidden";
    link.send("view", { detail, glass: detail && store.state.glass });
}
document.addEventListener("visibilitychange", () => {
    sendView();
    if (document.visibilityState !== "hidden") link.retryNow();
});

function sendSpeed() {
    link.send("speed", { scale: speedOf(store.state) });
}

function setSpeed(changes) {
    store.set(changes);
    settings.set("speed", String(store.state.speed));
    settings.set("fine", store.state.fine ? "yes" : "no");
    sendSpeed();
}

/** What the person chose on another computer has come. */
settings.addEventListener("loaded", () => {
    const { speed, fine } = safeSpeed(store.state, memory);
    store.set({ speed, fine, glass: memory.get("glass") === "open" });
    sendSpeed();
    sendView();
    views.recall();
});

setInterval(() => {
    const { latencyMs, rate, width, height } = sender;
    store.set({ sender: { latencyMs, rate, width, height } });
}, 250);

// What the person wants

function toggleArm() {
    if (!isDriving(store.state)) return;
    link.send(store.state.robot.armed ? "disarm" : "arm");
}

async function reset() {
    if (link.send("reset")) return;
    try {
        await api.resetRobot(robotId());
    } catch (error) {
        notices.show(describeError(error), { kind: "bad" });
    }
}

stopper.addEventListener("state", ({ detail }) => {
    store.set({ stopping: detail });
    if (detail === "failed") {
        notices.show(texts.stopFailed, { kind: "bad", name: "stop", stay: true });
    } else notices.clear("stop");
});

const opening = new Opening({ store, api, sheets, notices, galleries, views, video, robotId });

const wishes = {
    stop: () => stopper.stop(),
    start: () => starting.start(),
    first: () => starting.first(),
    whose: () => starting.whose(),
    reset,
    source: (wanted) => {
        settings.set("source", wanted.kind);
        starting.choose(wanted);
    },
    swap: () => views.swap(),
    "toggle-control": () => control.toggle(),
    "keep-control": () => link.send("keep_control"),
    "hand-over": ({ to }) => control.handOver(to),
    "toggle-arm": toggleArm,
    glass: ({ open }) => {
        store.set({ glass: open });
        settings.set("glass", open ? "open" : "folded");
        sendView();
    },
    language: async ({ language }) => {
        settings.set("language", language);
        await settings.flush();
        location.reload(); // the page speaks it from its first word on
    },
    "toggle-fine": () => {
        if (isDriving(store.state)) setSpeed({ fine: !store.state.fine });
    },
    // Who moves the slider wants its speed, fine or not.
    speed: ({ speed: wanted }) => setSpeed({ speed: wanted, fine: false }),
    "reset-scene": () => opening.resetScene(),
    help: () => {
        if (sheets.name === "help") sheets.close();
        else sheets.show("help", texts.help.title, helpContent(() => starting.first(true), () => opening.preflight()));
    },
    "edit-gesture": ({ id }) => opening.edit(id),
};

root.addEventListener("farhand:want", ({ detail }) => wishes[detail.what](detail));
byId("help-open").addEventListener("click", wishes.help);
byId("account-open").setAttribute("aria-label", texts.account.open);
byId("account-open").addEventListener("click", () => opening.account());
byId("timeline-open").setAttribute("aria-label", texts.timeline.open);
byId("timeline-open").addEventListener("click", () => opening.timeline());
byId("teach-open").addEventListener("click", () => opening.teach());
byId("manage-open").addEventListener("click", () => opening.manage());

window.farhand = inspection({
    store,
    sender,
    feeds,
    counts,
    error: () => lastError,
    shown: () => pictures.shown,
    reading,
});

link.open();
source.listCameras();
