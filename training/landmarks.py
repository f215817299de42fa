"""Hand landmarks of the webcam photographs by MediaPipe Hands 0.10.14, in its own environment.

``PEER/bin/python training/landmarks.py PHOTOS OUT.json`` (``pip install mediapipe==0.10.14``; it
brings another OpenCV, so it never shares the project's environment). The labels of
``training.labels`` start from them. Nothing of MediaPipe is in what is shipped.
"""

import json
import sys
from pathlib import Path

import cv2
import mediapipe as mp


def main() -> None:
    """Write {"LABEL/NAME": [[x, y] x 21 in 0..1] or null} of all ``webcam-box`` photographs."""
    folder, out = Path(sys.argv[1]) / "webcam-box", Path(sys.argv[2])
    found = {}
    with mp.solutions.hands.Hands(
        static_image_mode=True, max_num_hands=1, min_detection_confidence=0.3
    ) as hands:
        for path in sorted(folder.glob("*/*.jpg")):
            picture = cv2.cvtColor(cv2.imread(str(path)), cv2.COLOR_BGR2RGB)
            hand = hands.process(picture).multi_hand_landmarks
            points = [[p.x, p.y] for p in hand[0].landmark] if hand else None
            found[f"{path.parent.name}/{path.stem}"] = points
    out.write_text(json.dumps(found))
    print(f"{sum(p is not None for p in found.values())} of {len(found)}")


if __name__ == "__main__":
    main()
