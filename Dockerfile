# The headless server: gateway, robot node and camera process in one container.
#   docker build -t farhand . && docker run -p 127.0.0.1:8000:8000 -v farhand:/data farhand
# Then put a TLS proxy in front of it; docs/deploy.md has that, and a container without a proxy.
FROM python:3.11-slim-bookworm AS build
WORKDIR /src
# pybullet, simplejpeg and the rest come as wheels on x86-64; a compiler is not needed.
COPY requirements.lock ./
RUN pip install --no-cache-dir uv && python -m venv /opt/farhand \
    && uv pip install --python /opt/farhand/bin/python --require-hashes --no-deps -r requirements.lock
# The networks for hand landmarks, out of their wheel; the rest of it is not needed.
COPY app/pipeline/hand_landmarks/mediapipe.lock ./
RUN uv pip install --python /opt/farhand/bin/python --require-hashes --no-deps --target /tmp/mediapipe \
        -r mediapipe.lock \
    && install -D -m 644 -t /opt/farhand/share/farhand/models /tmp/mediapipe/mediapipe/modules/*/palm_detection_*.tflite \
        /tmp/mediapipe/mediapipe/modules/hand_landmark/hand_landmark_*.tflite \
    && rm -r /tmp/mediapipe
COPY pyproject.toml README.md LICENSE ./
COPY training/NOTICE training/NOTICE
COPY app app
COPY gesture_db gesture_db
RUN uv pip install --python /opt/farhand/bin/python --no-deps .

FROM python:3.11-slim-bookworm
RUN useradd --system --uid 10001 --create-home farhand && install -d -m 0700 -o farhand /data
COPY --from=build /opt/farhand /opt/farhand
ENV PATH=/opt/farhand/bin:$PATH PYTHONUNBUFFERED=1 \
    FARHAND_DATA_DIR=/data FARHAND_HOST=0.0.0.0 FARHAND_PORT=8000 FARHAND_BEHIND_PROXY=true \
    FARHAND_PIPELINE__LANDMARKS__FOLDER=/opt/farhand/share/farhand/models \
    FARHAND_PROXY_ADDRESSES='["127.0.0.0/8", "::1", "gateway"]'
USER farhand
WORKDIR /data
VOLUME /data
EXPOSE 8000
HEALTHCHECK --interval=10s --timeout=3s --start-period=30s CMD \
    ["python", "-c", "import urllib.request as u; u.urlopen('http://127.0.0.1:8000/api/health', timeout=2)"]
CMD ["farhand", "serve"]
