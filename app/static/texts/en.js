// Every word of the page, in English. Another language is another file like this one.

import { asSentence, plural } from "./forms.js";

/** The server speaks English: its words stay as they are. */
export const phrases = null;

export const texts = Object.freeze({
    title: "Farhand",
    skip: "Skip to the cockpit",
    stop: "STOP",
    stopHint: "Space",
    stopLabel: "Stop the robot",
    stopStates: {
        sending: "Stopping…",
        stopped: "Stopped",
        failed: "Not confirmed",
    },
    stopFailed:
        "The stop was not confirmed. Press STOP again, or cover the camera: without frames the " +
        "robot stops by itself.",

    numbers: {
        decimal: ".",
        percent: (number) => `${number}%`,
        quote: (text) => `“${text}”`,
    },

    language: {
        note: "The page loads anew. Who drives gives up control by that.",
    },

    headings: {
        header: "State",
        stage: "Robot",
        operator: "Your hand",
        gestures: "Gestures",
        readout: "Arm",
        dock: "Controls",
    },

    modes: {
        unknown: "No robot",
        disarmed: "Disarmed",
        armed: "Armed",
        moving: "Moving",
        holding: "Holding",
        stopped: "Stopped",
        faulted: "Fault",
    },

    driver: {
        nobody: "Nobody drives",
        you: "You drive",
        other: (name) => `${name} drives, you watch`,
    },

    connection: {
        connecting: "Connecting…",
        open: "Connected",
        waiting: (seconds) => `No server, next try in ${seconds} s`,
        "signed-out": "Signed out",
    },

    gone: {
        title: "The server does not answer",
        words:
            "The robot stops by itself when no frames reach it. Nothing is armed when the " +
            "connection comes back.",
        retry: "Try now",
        awayTitle: "The server has ended the connection",
        awayWords: (why) => `It says: ${why}. This page goes on trying by itself.`,
        signedOutTitle: "You are signed out",
        signedOutWords:
            "Open the link that the server printed when it started. It signs this browser in.",
        reload: "Load the page again",
    },

    steps: { source: "Input", control: "Control", armed: "Armed" },

    actions: {
        start: "Start driving",
        take: "Take control",
        takeOver: "Take over",
        release: "Release",
        arm: "Arm",
        disarm: "Disarm",
        reset: "Reset",
        teach: "Teach a gesture",
        help: "Help",
        close: "Close",
        cancel: "Cancel",
        retry: "Try again",
    },

    takeOver: {
        title: "Somebody else drives",
        words: (name) =>
            `${name} drives now. You can ask for control, and ${name} hands it over or drives on. ` +
            "If you take over, the arm stops at once. Either way it has to be armed again.",
    },

    people: {
        ask: "Ask for control",
        asked: (name) => `${name} is asked for control.`,
        asks: (name, more) =>
            more > 0 ? `${name} and ${more} more ask for control.` : `${name} asks for control.`,
        handOver: "Hand over",
        keep: "Drive on",
        yours: "Control is yours. Arm the robot to drive.",
        watching: (count) => (count === 1 ? "1 other here" : `${count} others here`),
    },

    speed: {
        label: "Speed",
        fine: "Fine",
        fineHint: "A fifth of the ordinary speed (F)",
    },

    resetScene: {
        button: "Put things back",
        when: "While the robot is disarmed or stopped",
        title: "Put things back?",
        words:
            "Every thing that can be moved jumps back to where it was at first, also out of the " +
            "gripper. The arm does not move.",
        yes: "Put them back",
        done: "Everything is back in its place.",
    },

    sentence: {
        connecting: "Connecting to the server…",
        gone: "The connection is lost. The robot stops by itself; trying to reach the server.",
        signedOut: "Signed out. Open the link that the server printed.",
        noRobot: "The robot does not answer yet.",
        fault: (why) => `The robot is in trouble: ${why}`,
        faultUnknown: "no reason given",
        stopped: (why) => (why ? `Stopped: ${why}.` : "Stopped."),
        stoppedNext: "Reset when it is safe; that moves nothing.",
        stoppedWatch: "An operator can reset it.",
        watching: "Nobody drives. You watch, and can stop the robot.",
        noSource: "Show the robot a hand: use your camera, try it without one, or use keys.",
        sourceStarting: "Waiting for the camera. Allow it in the browser if asked.",
        noControl: "Take control to drive.",
        otherDrives: (name) => `${name} drives. You watch; your gestures move nothing.`,
        disarmed: "Arm the robot, and gestures move it.",
        disarmedKeys: "Arm the robot, and keys move it.",
        disarmedWhy: (why) => `Disarmed: ${why}. Arm to go on.`,
        holding: (why) => (why ? `Holding still: ${why}.` : "Holding still."),
        holdingNext: "Show no gesture for half a second, then show it again.",
        holdingKeys: "Let go for half a second, then press again.",
        readyKeys: "Ready. Hold a button or a key.",
        // Why it holds, when what you show or see cannot be trusted.
        doubts: {
            no_hand: "your hand is not in the picture",
            unknown_hand: "your hand shows no gesture that it knows",
            two_hands: "there are two hands in the picture, and it obeys one",
            low_margin: "your hand is between two gestures, and it does not guess",
            frozen: "your webcam sends the same picture over and over; turn it off and on again",
            stale_picture: "the picture of the robot that you see is old",
        },
        noFrames: "No pictures reach the server. Is the camera covered or the page hidden?",
        waitingPicture: "Waiting for the first pictures…",
        ready: "Ready. Show a gesture.",
        moving: (what) => `Moving: ${what}.`,
        movingHold: (gesture, what) => `“${gesture}”: ${what}, while you hold it.`,
        done: (gesture) => `“${gesture}” is done. Lower your hand, then show the next one.`,
        seen: (gesture) => `Sees “${gesture}”.`,
        seenIdle: (gesture, next) => `Sees “${gesture}”. ${next}`,
        limits: (limits) => `Limit: ${limits}.`,
    },

    stage: {
        views: { wrist: "Wrist camera", scene: "Scene camera", "3d": "3D view" },
        enlarge: (view) => `Make the ${view} large`,
        swap: "Swap wrist and scene (W)",
        noPicture: "No picture yet",
        noCamera: "The camera does not answer",
        age: (seconds) => `${seconds} s old`,
        hide: "Hide the 3D view",
        show: "Show the 3D view",
        slow3d: "It is slow on this computer, and slows the camera too.",
        no3d: "This browser cannot draw 3D here (WebGL is off). The camera pictures do the same.",
        loading3d: "Loading the 3D view…",
        failed3d: "The 3D view did not load.",
    },

    operator: {
        useCamera: "Use my camera",
        useCameraWords: "Your picture goes to this server only, and is not kept.",
        trySynthetic: "No camera? Try it",
        trySyntheticWords: "A drawn hand shows the gestures, over and over.",
        useKeys: "Drive by keys",
        useKeysWords: "Keyboard, buttons or a gamepad. Gestures are not needed.",
        choose: "Camera",
        otherCamera: (number) => `Camera ${number}`,
        front: "Front camera",
        rear: "Rear camera",
        stop: "Turn off",
        demonstration: "Demonstration",
        asking: "Waiting for the camera…",
        shows: (gesture) => `Shows “${gesture}”`,
        showsNothing: "Between two gestures",
        previewLabel: "Your picture, mirrored, with the hand that was found",
    },

    // What the recognition makes of the hand, in one sentence.
    thought: {
        noSource: "No picture: choose a camera above.",
        waiting: "Waiting for the first pictures.",
        noFrames: "No picture was looked at for a while.",
        causes: {
            no_hand: "No hand in the box.",
            two_hands: "Two hands in the box: show one.",
            waiting: "Waiting for three pictures, to see what moves.",
            nothing_enrolled: "No gesture is taught yet: there is nothing to compare with.",
            moving: "The hand moves: hold it still.",
            unknown_hand: "The hand is unlike every gesture that is taught.",
            low_margin: "Two gestures are about equally close: show one more clearly.",
        },
        movingNear: (first) => `Perhaps “${first}”, but the hand moves: hold still.`,
        tooFar: (first) => `“${first}” is closest, but too far off to count.`,
        unlike: (first) => `“${first}” is closest, but the outline is unlike any that is taught.`,
        between: (first, second) =>
            `“${first}” is closest, and “${second}” almost as close: show it more clearly.`,
        settling: (first) => `“${first}” is closest: hold still.`,
        settlingNext: (first, second) => `“${first}” is closest, before “${second}”: hold still.`,
        sure: (first) => `It is “${first}”.`,
        sureNext: (first, second) => `It is “${first}”; “${second}” is farther off.`,
    },

    glass: {
        title: "How your hand is read",
        failed: "The steps could not be loaded.",
        steps: "The steps, in their order",
        unreached: "not reached",
        mask: "Mask",
        maskValue: (share) => `${share} is hand`,
        maskNone: "no hand",
        maskAlt: (share) =>
            share ? `The hand, white: ${share} of the picture` : "Nothing that is taken for a hand",
        motion: "Motion",
        motionValue: (share, limit) => `${share} of ${limit}`,
        motionAlt: (share, limit, still) =>
            `What changed, bright: ${share} of the picture, ` +
            (still ? `under ${limit}, so the hand is still` : `and under ${limit} it is still`),
        wrist: "Wrist",
        wristValue: { bottom: "cut below", top: "cut above", left: "cut right", right: "cut left" },
        wristNone: "no arm to cut",
        wristAlt: {
            circle:
                "How much hand each line holds, as a curve; the palm's circle; and the cut, a number of its radii away",
            histogram:
                "How much hand each line holds, as a curve; and the cut, where the curve is lowest beyond the palm",
            off: "How much hand each line holds, as a curve; nothing is cut off",
        },
        region: "Region",
        regionValue: (width, height) => `${width} × ${height}`,
        regionAlt: (width, height) => `The box round the hand: ${width} by ${height} points`,
        template: "Template",
        templateValue: "60 × 80",
        templateAlt: "What is compared: the hand at 60 by 80 points",
        projection: "Projection",
        projectionValue: (share) => `${share} of all difference`,
        projectionAlt: (near) =>
            "Every taught template on the two axes in which they differ most, and your hand" +
            (near ? `, nearest to “${near}”` : ", which is not there now"),
        legend: { first: "closest", second: "second", you: "your hand" },
        nearest: "Nearest templates",
        noneNear: "Nothing is compared now.",
        nearestItem: (gesture, distance) => `“${gesture}”, distance ${distance}`,
        room: "Room before it is refused",
        distance: "Distance",
        lead: "Lead over the second",
        outline: "Outline's error",
        atMost: (value, limit) => `${value}, at most ${limit}`,
        atLeast: (value, limit) => `${value}, at least ${limit}`,
        passes: "passes",
        refused: "refused",
        mode: "Hand found by",
        modes: { threshold: "plain threshold", learned: "learned mask" },
        modeValue: (way, why) => (why ? `${way}, because ${why}` : way),
        rate: "Pictures",
        rateValue: (rate) => `${rate} a second`,
        why: "In full",
        nothing: "–",
    },

    latency: {
        title: "Time from your camera to the robot's picture",
        total: (ms) => `${ms} ms`,
        whole: "camera to picture",
        partly: "of the known parts",
        age: (ms) => `picture ${ms} ms old`,
        noPicture: "no picture",
        unknown: "not known",
        none: "Nothing is sent and nothing shown yet.",
        ms: (ms) => (ms < 1 ? "under 1 ms" : `${ms} ms`),
        short: {
            encode: "cam",
            up: "up",
            wait: "wait",
            recognise: "read",
            motion: "robot",
            picture: "view",
        },
        names: {
            encode: "Capture and packing",
            up: "Way to the server",
            wait: "Waiting for a turn",
            recognise: "Reading the hand",
            motion: "Way to the robot, until it moves",
            picture: "Picture of it, back to you",
        },
        sum: "In all",
        pictureAge: "Age of the picture now",
    },

    sourceErrors: {
        denied: {
            title: "The browser keeps the camera closed",
            words:
                "Allow the camera for this page (the camera sign in the address bar), then try " +
                "again. Or go on without one.",
        },
        none: {
            title: "No camera was found",
            words: "Plug one in and try again, or go on without one.",
        },
        busy: {
            title: "Another program uses the camera",
            words: "Close the other program or tab that shows it, then try again.",
        },
        gone: {
            title: "That camera is not there any more",
            words: "Choose another one, or try again.",
        },
        unplugged: {
            title: "The camera was unplugged",
            words: "The robot holds still. Plug the camera in again, then try again.",
        },
        insecure: {
            title: "This address is not safe enough for a camera",
            words:
                "Browsers open the camera only on https:// or on localhost. Open the page that " +
                "way, or go on without a camera.",
        },
        unsupported: {
            title: "This browser gives no camera to pages",
            words: "Use a current browser, or go on without a camera.",
        },
        clip: {
            title: "The demonstration could not be played",
            words: "The server did not send the clip, or this browser cannot play WebM.",
        },
        failed: {
            title: "The camera could not be opened",
            words: "Try again. If that does not help, choose another camera.",
        },
    },

    jog: {
        title: "Keys",
        how: "The arm moves while you hold a button or its key.",
        gamepad:
            "Gamepad: hold a shoulder button and push a stick. A closes the gripper, X opens it, " +
            "Y goes home, B stops.",
        groups: { move: "Move", joint: "Joints", tool: "Gripper", pose: "Go to", program: "Programs" },
        moves: {
            forward: "Forward",
            back: "Back",
            left: "Left",
            right: "Right",
            up: "Up",
            down: "Down",
            "turn-left": "Turn left",
            "turn-right": "Turn right",
            "tip-forward": "Tip forward",
            "tip-back": "Tip back",
            "roll-left": "Roll left",
            "roll-right": "Roll right",
            open: "Open",
            close: "Close",
            home: "Home",
        },
        keys: {
            Shift: "⇧",
            ArrowUp: "↑",
            ArrowDown: "↓",
            ArrowLeft: "←",
            ArrowRight: "→",
            PageUp: "PgUp",
            PageDown: "PgDn",
        },
        joint: (name, sign) => `${name} ${sign < 0 ? "−" : "+"}`,
        picked: (joint) => `Keys + and − turn ${joint}; a digit picks another.`,
        pose: (name) => name,
    },

    gestures: {
        legend: "Longer is closer; past the mark it counts.",
        empty: "No gesture is enrolled yet. Teach the first one.",
        loading: "Loading the gestures…",
        failed: "The gestures could not be loaded.",
        edit: (name) => `Change “${name}”`,
        match: "Recognised",
        noDistance: "–",
    },

    first: {
        begin: "First minutes",
        goOn: "Go on with the first minutes",
        again: "Teach all of them again",
        known: "I know how: drive",
        welcome:
            "In about two minutes you drive the arm with your own hand. You can leave at any moment, " +
            "and go on later where you left.",
        disarmed: "Disarmed, so that what you show moves nothing.",
        steps: "First minutes",
        stepNames: {
            source: "Picture",
            whose: "Name",
            check: "Check",
            teach: "Teach",
            drive: "Drive",
        },
        titles: {
            source: "Your first minutes",
            whose: "Whose hand is it?",
            check: "Is your hand seen well?",
            teach: "Teach your gestures",
            drive: "Drive the arm",
        },
        drawingOf: (name) => `How to hold the hand for “${name}”`,
        // How the starter gestures are held, the palm to the camera.
        signs: {
            forward: "Index and middle finger up",
            back: "Four fingers up, the thumb in the palm",
            left: "A fist with the thumb out",
            right: "The little finger up",
            up: "The index finger up",
            down: "Index and little finger up",
            open: "The index finger up, the thumb out",
            close: "A fist",
            home: "The little finger up, the thumb out",
            stop: "The open hand, the thumb out",
        },

        whose: {
            title: "Whose hand is it?",
            open: (name) => `Whose hand: ${name}`,
            intro: "Hands differ. Each person teaches their own gestures once, and chooses them here.",
            newName: "Your name",
            nameMissing: "Give a name.",
            add: "Begin",
            known: "People who are known here",
            shared: "Anybody",
            sharedWords: "The gestures that everybody shares",
            taught: (taught, all) => `${taught} of ${all} gestures taught`,
            lost: "Those gestures were deleted on the server. The shared ones are used now.",
        },

        check: {
            intro: "Hold up your hand like the drawing, the palm to the camera.",
            introPlain: "Hold up your hand, the palm to the camera.",
            go: "Go on",
            left: "I use my left hand",
            good: "Very good. Going on…",
            lines: { light: "Light", distance: "Distance", background: "Background", still: "Stillness" },
            signs: { good: "good", fix: "could be better", wait: "waiting" },
            advice: {
                light: {
                    wait: "Waiting for the picture.",
                    dark: "Too dark. Turn on a lamp before you, or turn to the window.",
                    glare: "Too bright. Turn away from the lamp, or close a curtain.",
                    behind: "The light is behind you. Turn so that it falls on your hand.",
                    good: "Enough light.",
                },
                distance: {
                    wait: "Waiting for the picture.",
                    none: "No hand is seen yet. Hold it up, a forearm's length from the camera.",
                    cut: "Your hand runs out of the picture. Move it to the middle.",
                    far: "Too far away. Come closer.",
                    near: "Too close. Move back a little.",
                    aside: "Move your hand to the middle of the picture.",
                    good: "Your whole hand is in the picture.",
                },
                background: {
                    wait: "Waiting for your hand.",
                    two: "Two hands, or a face like one. Show one hand alone.",
                    faint: "Your hand looks like what is behind it. Hold it before another colour.",
                    busy: "Not plain, but your hand is found.",
                    good: "Plain. Your hand stands out.",
                },
                still: {
                    wait: "Waiting for your hand.",
                    moving: "Hold your hand still.",
                    good: "Your hand rests.",
                },
            },
        },

        teach: {
            title: (name, number, all) => `${number} of ${all}: “${name}”`,
            all: "All gestures",
            tile: (name, status) => `${name}: ${status}`,
            statuses: { now: "now", open: "to be taught", taught: "taught", skipped: "skipped" },
            phases: {
                change: "Now this one: change your hand.",
                show: "Show this, the palm to the camera, and hold still.",
                hold: "Hold still…",
                taken: "Looking…",
            },
            looking: "Looking…",
            saving: "Saving…",
            stops: "This one really stops the robot; a reset makes it ready again. Show it, and hold still.",
            stopsOther: (name) => `Take care: ${name} drives now, and this one stops the arm.`,
            taught: (name, near) =>
                near ? `“${name}” is taught. It is not far from “${near}”.` : `“${name}” is taught.`,
            kept: (name) => `“${name}” is kept as it is.`,
            skipped: (name) => `“${name}” is skipped; it stays as it was.`,
            notSaved: (name, why) => `“${name}” was not saved: ${why} Show it again.`,
            like: (name) => `This looks like “${name}”.`,
            weak: (why, more) => [asSentence(why), asSentence(more), "Lower your hand, then show it again."]
                .filter(Boolean)
                .join(" "),
            problems: {
                no_hand: "No hand was found in the pictures.",
                cut_off: "Your hand runs out of the picture.",
                too_small: "Your hand is too far away.",
                two_hands: "There are two hands in the picture, or something like one.",
                no_wrist: "Your wrist is not seen. Hold your hand higher, sleeves pulled back.",
                blurred: "The pictures are blurred. Hold still, and give more light.",
                no_picture: "The camera gave no picture.",
                other: "The pictures cannot be used.",
            },
            keep: "Keep it as it is",
            back: "Back (B)",
            redo: "Redo (R)",
            skip: "Skip (S)",
            over: (taught, skipped) =>
                skipped
                    ? `${plural(taught, "gesture is", "gestures are")} taught, ${skipped} skipped.`
                    : `All ${taught} gestures are taught.`,
        },

        drive: {
            list: {
                control: "Take control",
                arm: "Arm",
                show: "Move the arm by two gestures",
                stop: "Stop it",
                reset: "Reset",
            },
            tasks: {
                wait: () => "Waiting for the robot.",
                ask: (name) => `${name} drives now. Ask for control below.`,
                control: () => "Press “Take control” below.",
                arm: () => "Press “Arm” below. Lower your hand first.",
                stop: () => "Now stop it: press STOP below, or the space bar.",
                reset: () => "The robot is stopped. Press “Reset” below: that moves nothing.",
                done: () => "That is all. Take control, arm, and drive.",
            },
            why: {
                control: "Only one person drives at a time.",
                arm: "From then on your gestures move the robot.",
                stop: "It works at any time, whoever drives.",
                reset: "After a stop nothing moves until somebody resets and arms.",
            },
            show: (name, moved) =>
                moved
                    ? `Very good. Now show “${name}”, and hold it.`
                    : `Show “${name}”, and hold it: the arm moves while you do.`,
            watch: "The drawn hand shows its gestures. Watch the arm move.",
            showWhy: "Lower your hand, and it stands still.",
            finish: "Drive",
        },
    },

    readout: {
        joint: (number) => `J${number}`,
        jointLabel: (number, value) => `Joint ${number}: ${value}`,
        gripper: "Gripper",
        gripperOpen: (width) => `${width} mm open`,
        tool: "Tool",
        toolValue: (x, y, z) => `x ${x}  y ${y}  z ${z} cm`,
        place: "Place",
        placeValue: (x, y, heading) => `x ${x}  y ${y} cm  ${heading}°`,
        slideValue: (way) => `${way} cm`,
        nothing: "at rest",
        nearest: "Nearest",
        nearestValue: (distance, thing, link) => `${distance} mm, ${thing} to ${link}`,
        itself: (link) => `the arm's own ${link}`,
        limits: "Limits",
    },

    action: {
        straight: {
            base: { "x+": "forward", "x-": "back", "y+": "left", "y-": "right", "z+": "up", "z-": "down" },
            tool: {
                "x+": "along tool x",
                "x-": "against tool x",
                "y+": "along tool y",
                "y-": "against tool y",
                "z+": "along tool z",
                "z-": "against tool z",
            },
        },
        toolAxis: (axis) => `tool ${axis}`,
        linear: (direction, speed) => `${direction} ${speed} cm/s`,
        angular: (axis, speed) => `turn about ${axis} ${speed}°/s`,
        jogJoint: (joint, speed) => `turn ${joint} ${speed}°/s`,
        turnJoint: (joint, angle) => `turn ${joint} by ${angle}°`,
        slideJoint: (joint, speed) => `move ${joint} ${speed} cm/s`,
        slideJointBy: (joint, way) => `move ${joint} by ${way} cm`,
        pose: (name) => `go to “${name}”`,
        open: "open gripper",
        closed: "close gripper",
        gripper: (width) => `gripper to ${width} mm`,
        force: (what, force) => `${what} with ${force} N`,
        way: (direction, length) => `${direction} by ${length} cm`,
        turnBy: (axis, angle) => `turn about ${axis} by ${angle}°`,
        wait: (seconds) => `wait ${seconds} s`,
        repeat: (times, what) => `${times} times: ${what}`,
        home: "go home",
        stop: "stop the robot",
        stand: "stand still",
        lasting: (what, seconds) => `${what} for ${seconds} s`,
        sequence: (first, more) => (more ? `${first}, then ${plural(more, "step", "steps")}` : first),
        unknown: "unknown action",
    },

    teach: {
        title: "Teach a gesture",
        editTitle: (name) => `Change “${name}”`,
        name: "Name",
        nameHint: "1 to 60 characters, such as “wave”",
        nameMissing: "Give the gesture a name.",
        action: "What the robot does",
        pictures: "Pictures of the hand",
        picturesHint: "One is enough; three from slightly different sides are better.",
        morePictures: "Add pictures",
        enrolled: (count) => plural(count, "picture enrolled", "pictures enrolled"),
        capture: "Take a picture",
        captureThree: "Take three",
        captureCancel: "Stop the countdown",
        countdown: (number) => `Hold your hand still: ${number}`,
        noSource: "Turn on your camera first (under “Your hand”).",
        stillsMissing: "Take at least one picture of the hand.",
        still: (number) => `Picture ${number}`,
        removeStill: (number) => `Remove picture ${number}`,
        checking: "checking…",
        stillGood: "hand found",
        stillResembles: (name) => `hand found; looks like “${name}”`,
        resembles: (name) =>
            `This hand looks like “${name}”. A shape further away is told apart more safely.`,
        save: "Save gesture",
        saveChanges: "Save changes",
        saving: "Saving…",
        saved: (name) => `“${name}” is saved.`,
        deleted: (name) => `“${name}” is deleted.`,
        delete: "Delete",
        deleteAsk: (name) => `Delete “${name}” and its pictures? This cannot be undone.`,
        deleteYes: "Yes, delete",
        deleteNo: "Keep it",
    },

    actionForm: {
        kind: "Action",
        kinds: {
            straight: "Move in a straight line, while held",
            exact: "Move and turn with exact speeds, while held",
            move_linear: "Move by an exact way, in a straight line",
            jog_joint: "Turn one joint, while held",
            turn_joint: "Turn one joint by an angle",
            pose: "Go to a pose",
            gripper: "Open or close the gripper",
            home: "Go home",
            stop: "Stop the robot",
            sequence: "Several steps, one after another",
            wait: "Wait",
            repeat: "Repeat some steps",
        },
        direction: "Direction",
        frame: "Seen from",
        frames: { base: "the robot's base", tool: "the tool" },
        speed: "Speed, cm/s",
        jointSpeed: "Speed, °/s (below 0: the other way)",
        joint: "Joint",
        angle: "Angle, ° (below 0: the other way)",
        pose: "Pose",
        width: "Opening, mm (0: closed)",
        force: "Force, N (empty: as strong as it can)",
        ownSpeed: "Speed, cm/s (empty: the robot's own)",
        offset: (axis) => `Along ${axis}, cm`,
        rotation: (axis) => `Turn about ${axis}, °`,
        wait: "How long, s",
        times: "How often",
        linear: (axis) => `Along ${axis}, cm/s`,
        angular: (axis) => `About ${axis}, °/s`,
        duration: "For how long, s",
        step: (number) => `Step ${number}`,
        addStep: "Add a step",
        removeStep: (number) => `Remove step ${number}`,
        upStep: (number) => `Move step ${number} up`,
    },

    check: {
        check: "Check it",
        checking: "Checking… Nothing moves.",
        from: "Check it from",
        current: "where the arm is now",
        home: "home",
        good: (seconds) => `Nothing is in the way. It takes ${seconds} s.`,
        goodSlowed: (seconds) => `It can be done, slowed down in places. It takes ${seconds} s.`,
        bad: (count) =>
            count === 1 ? "It meets a limit:" : `It meets ${count} limits:`,
        inStep: (step, what) => `Step ${step}: ${what}`,
        anywhere: (what) => what,
        after: (what, seconds) => `${what} (after ${seconds} s)`,
        former: "What it did before",
        formerNote: "Taking one back changes the gesture at once.",
        noFormer: "It has always done this.",
        since: (when) => ` since ${when}`,
        restore: "Take back",
        restoreVersion: (version) => `Take version ${version} back`,
        restored: (name) => `“${name}” does what it did before.`,
    },

    errors: {
        unreachable: "The server does not answer. Try again when the connection is back.",
        other: (status) => `The server said no (${status}).`,
        reset: "The reset was not accepted.",
        // By the server's codes; see docs/protocol.md.
        codes: {
            not_signed_in: "You are signed out. Open the link that the server printed.",
            not_allowed: "You may not do that here.",
            foreign_origin: "This page does not belong to this server. Open the server's link.",
            gestures_lost: "The gesture database was lost; until it is back, nothing can be armed.",
            not_found: "The server does not have that any more.",
            duplicate: "That name is taken. Choose another one.",
            changed_meanwhile: "Somebody else has changed that meanwhile. Look at it again.",
            no_control: "You do not have control.",
            control_kept: "Who drives goes on driving.",
            nobody_asks: "Nobody asks for that any more.",
            control_lost: "Control is lost.",
            shared_gallery: "The shared gestures stay.",
            refused: "The robot refused.",
            latched: "The robot is stopped: reset it first.",
            moving: "The arm has not come to rest yet.",
            armed: "That can be done only while the robot is disarmed or stopped.",
            too_large: "That is too large for the server.",
            invalid: "A value is out of its bounds.",
            bad_action: "That is no action that the robot knows.",
            no_dry_run: "A robot that drives cannot be checked beforehand.",
            unknown_pose: "The robot has no such pose.",
            image_refused: "The picture has no usable hand in it.",
            busy: "There is too much to do right now. Try again in a moment.",
            internal: "Something went wrong inside the server; its log says what.",
            robot_unavailable: "The robot does not answer.",
            no_picture: "The camera gave no picture.",
            viewer_unavailable: "The 3D view is off or does not answer.",
            database_broken: "The gesture database cannot be read.",
            database_busy: "Another program holds the gesture database.",
            disk_full: "The server has no space left.",
        },
    },

    notices: {
        reconnected: "Connected again. Take control and arm to drive on.",
        lostControl: "You no longer drive.",
        dismiss: "Dismiss",
    },

    preflight: {
        title: "Check this browser",
        open: "Check camera, connection and 3D view",
        checking: "Checking; the browser may ask for the camera…",
        none: "All is well.",
        some: "Something is missing. This is how to mend it:",
        fine: {
            camera: "The camera can be used",
            socket: "Live connections reach the server",
            webgl: "3D can be drawn",
        },
        problems: {
            socket: {
                title: "Live connections (WebSockets) are blocked",
                words:
                    "The page arrives, and what moves the robot does not. A proxy, a filter or a " +
                    "browser extension stops it: switch the extension off, try another network, or " +
                    "ask who runs the proxy to let WebSockets through. If the browser warns of the " +
                    "certificate, it must trust it first: open /trust at this address.",
            },
            webgl: {
                title: "3D cannot be drawn (WebGL is off)",
                words:
                    "Driving works without it, by the camera pictures. To have it, switch on " +
                    "hardware acceleration in the browser's settings, or use a current browser.",
            },
        },
    },

    help: {
        title: "Help",
        how: [
            "Start driving: choose your camera, the drawn hand if you have none, or keys.",
            "Take control: only one person drives at a time.",
            "Arm: from now on your gestures move the robot.",
            "Show a gesture and keep still. The robot moves while you hold it, and stops when you lower your hand.",
        ],
        keysTitle: "Keys",
        keys: [
            ["Space", "Stop"],
            ["Esc", "Stop"],
            ["A", "Arm or disarm"],
            ["C", "Take or release control"],
            ["F", "Fine: a fifth of the speed"],
            ["W", "Swap wrist and scene"],
            ["Arrows, Page Up, Page Down", "With “Drive by keys”: move; with Shift: turn"],
            ["1 to 9, + and −", "With “Drive by keys”: pick a joint, turn it"],
            ["O, G, H", "With “Drive by keys”: open, close the gripper, go home"],
            ["?", "This help"],
        ],
        keysNote: "Space always stops; press buttons with Enter. Keys do nothing while you type in a field.",
        safetyTitle: "About stopping",
        safety:
            "The stop goes over a network. It is not an emergency stop in the sense of ISO 13850. " +
            "If pictures stop coming, whatever the cause, the robot stands still within half a second.",
    },
});
