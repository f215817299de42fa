"""The other side of ``benchmarks.recognition``: MediaPipe Hands, in an environment of its own.

It speaks JSON lines. In: ``{"path": FILE, "before": null}``. Out: ``landmarks``, 21 triples in
pixels of the picture (z in the unit of x) or null without a hand, and the time from the file's
bytes to them: ``wall_ms``, and ``cpu_ms`` over all threads. With another file as ``before`` both go
to a second instance that follows hands over frames, as in a video, and the time of the second
picture counts. ``{"ready": VERSION}`` comes first.

This file imports nothing of the project and is run by ``benchmarks.recognition.peer``.
"""

import json
import sys
import time
from typing import Any


def main() -> None:
    import cv2
    import mediapipe
    import numpy as np

    cv2.setNumThreads(1)
    confidence = float(sys.argv[1])
    single, video = (
        mediapipe.solutions.hands.Hands(
            static_image_mode=static, max_num_hands=1, min_detection_confidence=confidence
        )
        for static in (True, False)
    )

    def look(path: str, hands: Any) -> dict[str, Any]:
        with open(path, "rb") as file:
            data = file.read()
        wall, cpu = time.perf_counter(), time.process_time()
        picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
        assert picture is not None
        found = hands.process(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB))
        landmarks = None
        if found.multi_hand_landmarks:
            height, width = picture.shape[:2]
            landmarks = [
                (p.x * width, p.y * height, p.z * width)
                for p in found.multi_hand_landmarks[0].landmark
            ]
        return {
            "landmarks": landmarks,
            "wall_ms": (time.perf_counter() - wall) * 1000,
            "cpu_ms": (time.process_time() - cpu) * 1000,
        }

    # Whatever the libraries print must not get between the lines.
    out, sys.stdout = sys.stdout, sys.stderr
    print(json.dumps({"ready": mediapipe.__version__}), file=out, flush=True)
    for line in sys.stdin:
        asked = json.loads(line)
        hands = single
        if asked["before"] is not None:
            hands = video
            # Twice: a hand lost since the picture before that is looked for again in the next.
            look(asked["before"], hands)
            look(asked["before"], hands)
        print(json.dumps(look(asked["path"], hands)), file=out, flush=True)


if __name__ == "__main__":
    main()
