// What can be held down: moves of this robot, each with its words, its key and its action.

import { texts } from "../texts/texts.js";
import { jointName } from "./words.js";

const words = texts.jog;
const LINEAR = 0.1; // m/s, as the starter gestures
const ANGULAR = 0.5; // rad/s
const DRIVE = 0.25; // m/s, of a base on wheels
const JOINT = 0.4; // rad/s
const SLIDE = 0.1; // m/s

const along = (axis, speed) => [0, 1, 2].map((each) => (each === axis ? speed : 0));
const jog = (frame, linear, angular) => ({ type: "jog_cartesian", frame, linear, angular });
const STILL = [0, 0, 0];

function cartesian(drives) {
    if (drives) {
        const move = (id, linear, angular, key) => ({
            id, key, action: jog("tool", along(0, linear), along(2, angular)),
        });
        return [
            move("forward", DRIVE, 0, "ArrowUp"),
            move("back", -DRIVE, 0, "ArrowDown"),
            move("turn-left", 0, ANGULAR, "ArrowLeft"),
            move("turn-right", 0, -ANGULAR, "ArrowRight"),
        ];
    }
    const go = (id, axis, sign, key) => ({
        id, key, action: jog("base", along(axis, sign * LINEAR), STILL),
    });
    const turn = (id, axis, sign, key) => ({
        id, key, action: jog("base", STILL, along(axis, sign * ANGULAR)),
    });
    return [
        go("forward", 0, 1, "ArrowUp"),
        go("back", 0, -1, "ArrowDown"),
        go("left", 1, 1, "ArrowLeft"),
        go("right", 1, -1, "ArrowRight"),
        go("up", 2, 1, "PageUp"),
        go("down", 2, -1, "PageDown"),
        turn("turn-left", 2, 1, "Shift+ArrowLeft"),
        turn("turn-right", 2, -1, "Shift+ArrowRight"),
        turn("tip-forward", 1, 1, "Shift+ArrowUp"),
        turn("tip-back", 1, -1, "Shift+ArrowDown"),
        turn("roll-left", 0, -1, "Shift+PageUp"),
        turn("roll-right", 0, 1, "Shift+PageDown"),
    ];
}

function joints(description) {
    return description.joints.flatMap((joint, index) => {
        const speed = Math.min(joint.unit === "m" ? SLIDE : JOINT, joint.velocity);
        return [-1, 1].map((sign) => ({
            id: `joint-${index + 1}${sign < 0 ? "-" : "+"}`,
            label: words.joint(jointName(index + 1), sign),
            joint: index + 1,
            sign,
            action: { type: "jog_joint", joint: index + 1, velocity: sign * speed },
        }));
    });
}

/**
 * All that can be held, in groups: {move, joint, tool, pose, program}, each a list of
 * {id, label, key, action}. Nothing before the robot has described itself.
 */
export function movesOf(description, gestures) {
    if (!description) return { move: [], joint: [], tool: [], pose: [], program: [] };
    const named = (moves) => moves.map((move) => ({ label: words.moves[move.id], ...move }));
    const widest = description.gripper_max || 0;
    const tool = [
        { id: "open", key: "O", action: { type: "gripper", width: widest } },
        { id: "close", key: "G", action: { type: "gripper", width: 0 } },
    ];
    const programs = gestures.filter(({ action, active }) =>
        active !== false && ["sequence", "turn_joint", "move_linear"].includes(action.type));
    return {
        move: named(cartesian(Boolean(description.drives))),
        joint: joints(description),
        tool: widest > 0 ? named(tool) : [],
        pose: [
            ...named([{ id: "home", key: "H", action: { type: "home" } }]),
            ...Object.keys(description.poses)
                .filter((name) => name !== "home")
                .map((name) => ({
                    id: `pose-${name}`, label: words.pose(name), action: { type: "pose", name },
                })),
        ],
        program: programs.map(({ id, name, action }) => ({
            id: `program-${id}`, label: name, action,
        })),
    };
}
