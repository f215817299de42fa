// A person before a webcam who does what the first minutes ask: shows what is drawn, holds it, lowers
// the hand in between. HANDS maps names to pictures of a rendered hand without a background.

(() => {
    if (window.top !== window) return;
    const LOWERED_MS = 500;
    const PUZZLED_MS = 1500; // the hand is up, and nothing comes of it: show it again
    const images = Object.fromEntries(
        Object.entries(HANDS).map(([name, data]) => {
            const image = new Image();
            image.src = data;
            return [name, image];
        }),
    );
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [640, 480];
    const context = canvas.getContext("2d");
    const person = { follows: true, wanted: null, shown: null, changedAt: 0, waitsSince: 0, log: [] };
    window.person = person;

    person.show = (name) => {
        person.wanted = name;
        person.changedAt = performance.now();
    };

    function look(now) {
        const sheet = document.querySelector("#sheet-first");
        const drawing = sheet && sheet.querySelector(".first-drawing");
        const found = drawing && /hands\/(\w+)\.webp/.exec(drawing.src);
        const asked = found ? found[1] : null;
        if (asked !== person.wanted) person.show(asked);
        const say = sheet && sheet.querySelector("[data-phase]");
        const robot = window.farhand && window.farhand.robot;
        const ignored = say
            ? say.dataset.phase === "change"
            : sheet && sheet.dataset.step === "drive" && robot && robot.mode !== "moving";
        if (!ignored || !person.shown) person.waitsSince = now;
        else if (now - person.waitsSince > PUZZLED_MS) person.show(asked);
    }

    function draw() {
        const now = performance.now();
        if (person.follows) look(now);
        person.shown = now - person.changedAt > LOWERED_MS ? person.wanted : null;
        const wall = context.createLinearGradient(0, 0, 0, 480);
        wall.addColorStop(0, "rgb(199, 208, 214)");
        wall.addColorStop(1, "rgb(174, 183, 190)");
        context.fillStyle = wall;
        context.fillRect(0, 0, 640, 480);
        if (person.shown) {
            // Hands tremble, at about 9 Hz.
            const tremble = 0.4 * Math.sin((2 * Math.PI * 9 * now) / 1000);
            context.drawImage(images[person.shown], tremble, 0.5 * tremble);
        }
        // A sensor never gives the same pixels twice.
        context.fillStyle = `rgb(${Math.floor(now) % 256}, 200, 210)`;
        context.fillRect(0, 0, 2, 2);
    }

    setInterval(draw, 33);
    navigator.mediaDevices.getUserMedia = async () => canvas.captureStream(30);
})();
