"""Settings: one model per concern. Every field has a default, bounds and a description.

Values come from the command line, then from the environment (``FARHAND_PORT``,
``FARHAND_PIPELINE__CHANNEL``: two underscores go one level down), then from the defaults here.
Unknown keys are refused. Settings are passed in, never read at import.
"""

import os
from ipaddress import IPv4Network, IPv6Network
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, IPvAnyNetwork, SecretStr, model_validator
from pydantic_settings import BaseSettings, SettingsConfigDict


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


Fraction = Annotated[float, Field(ge=0.0, le=1.0)]


class DecodeSettings(_Section):
    """What a webcam frame may be, and how large the pipeline makes it."""

    max_width: int = Field(default=1280, ge=64, le=4096, description="pixels")
    max_height: int = Field(default=720, ge=64, le=4096, description="pixels")
    max_bytes: int = Field(default=256 * 1024, ge=1024, le=8 << 20, description="bytes of one JPEG")
    working_side: int = Field(
        default=180,
        ge=48,
        le=2160,
        description="pixels; a frame is decoded at 1, 1/2, 1/4 or 1/8 of its size, the smallest "
        "whose shorter side has at least so many (640x480 becomes 320x240)",
    )


class SmoothSettings(_Section):
    """Integer Gaussian."""

    kernel: Literal[1, 3, 5, 7] = Field(default=5, description="pixels; 1 leaves the picture as is")


class NormaliseSettings(_Section):
    """Stretching the illumination to the full range."""

    clip: float = Field(
        default=0.0005,
        ge=0.0,
        le=0.2,
        description="part of the pixels, at each end of the histogram, that may saturate",
    )


class BinariseSettings(_Section):
    """From a picture to hand and background."""

    mode: Literal["auto", "threshold", "learned"] = Field(
        default="auto",
        description="threshold: a global threshold (the paper), for plain backgrounds; learned: a "
        "small network, for rooms; auto: whichever suits the picture, with the reason shown",
    )
    channel: Literal["luminance", "cr"] = Field(
        default="cr",
        description="plane that is thresholded: luminance (the paper) or the red difference Cr",
    )
    polarity: Literal["auto", "light", "dark"] = Field(
        default="auto",
        description="is the hand the lighter or the darker side of the threshold; auto: the side "
        "that holds less of the picture's border",
    )
    min_contrast: float = Field(
        default=5.0,
        ge=0.0,
        le=255.0,
        description="levels (of 255) between the mean of the hand and the mean of the background; "
        "with less there is no hand",
    )
    min_sure: float = Field(
        default=0.75,
        ge=0.5,
        le=1.0,
        description="learned mode: mean share of hand over the mask; with less there is no hand. "
        "Nine in ten true hands in rooms have 0.8 or more, most mistaken ones less than this",
    )
    fill_holes: Fraction = Field(
        default=0.015,
        description="threshold: holes smaller than this part of the hand are filled; 0 leaves them "
        "(paper)",
    )
    min_area: Fraction = Field(default=0.005, description="smallest hand, part of the picture")
    max_area: Fraction = Field(default=0.8, description="largest hand, part of the picture")


class LandmarkSettings(_Section):
    """Finding the hand by its landmarks, with MediaPipe's networks."""

    mode: Literal["auto", "on", "off"] = Field(
        default="auto",
        description="auto: where the networks are on this machine and binarise.mode is auto, too; "
        "before a plain background the threshold finds what they do not. on: the same, and without "
        "the networks nothing starts. off: hands are found by their mask alone",
    )
    folder: Path | None = Field(
        default=None,
        description="folder that holds the networks; default: the user's own, which farhand models "
        "add fills, then the installed package mediapipe",
    )
    palm: Literal["lite", "full"] = Field(
        default="lite", description="network that finds palms in a live picture"
    )
    hand: Literal["lite", "full"] = Field(
        default="lite", description="network that finds the landmarks in a live picture"
    )
    min_palm: Fraction = Field(
        default=0.5, description="least score of a palm in the whole picture (MediaPipe: 0.5)"
    )
    min_presence: Fraction = Field(
        default=0.5, description="least probability that a region holds a hand (MediaPipe: 0.5)"
    )
    working_side: int = Field(
        default=360,
        ge=48,
        le=2160,
        description="pixels; as decode.working_side, for the pictures that they look at",
    )


class MotionSettings(_Section):
    """The gate that lets only a hand at rest through."""

    threshold: Fraction = Field(
        default=0.01, description="still when fewer than this part of the pixels mismatch (paper)"
    )
    held_threshold: Fraction = Field(
        default=0.025,
        description="the same while a gesture is held, so that a hand that trembles keeps it",
    )
    interval_s: float = Field(
        default=0.0,
        ge=0.0,
        le=2.0,
        description="least time between two sampled frames; 0 samples every frame",
    )
    settle_s: float = Field(
        default=0.23,
        ge=0.0,
        le=1.0,
        description="a gesture may start only when the hand looks as it did so long ago; 0 leaves "
        "that out (paper)",
    )
    settle_threshold: Fraction = Field(
        default=0.05,
        description="it looks the same when fewer than this part of the hand's pixels mismatch",
    )
    hand_speed: float = Field(
        default=2.0,
        ge=0.0,
        le=50.0,
        description="palm lengths a second; a hand found by landmarks rests when it is slower",
    )
    hand_settle: float = Field(
        default=0.22,
        ge=0.0,
        le=2.0,
        description="in the unit of a match; it looks the same when its landmarks differ by less",
    )


class RoiSettings(_Section):
    """The box round the hand."""

    offset: float = Field(
        default=0.01,
        ge=0.0,
        le=0.25,
        description="a side moves inwards until white pixels exceed this part of the mask's width "
        "or height (paper: m/100 and n/100)",
    )


class WristSettings(_Section):
    """Where the arm is cut off."""

    mode: Literal["circle", "histogram", "off"] = Field(
        default="circle",
        description="circle: a number of palm radii below the palm's largest inscribed circle; "
        "histogram: the paper's minimum beyond the maximum; off: the arm stays",
    )
    radii: float = Field(
        default=1.3,
        ge=0.5,
        le=4.0,
        description="circle mode: palm radii from the palm's centre to the cut",
    )


class MatchSettings(_Section):
    """Which enrolled gesture is nearest, and when none is near enough."""

    features: Literal["shape", "distance", "binary"] = Field(
        default="shape",
        description="shape: distance, and what a small network learned of many hands; distance: "
        "signed distance transform squashed by tanh; binary: the pixels "
        "themselves (the paper)",
    )
    shape_weight: float = Field(
        default=0.8, ge=0.0, le=4.0, description="weight of the network's numbers, with shape"
    )
    components: int = Field(default=60, ge=1, le=400, description="principal components kept")
    turns: tuple[float, ...] = Field(
        default=(-0.45, -0.3, -0.15, 0.0, 0.15, 0.3, 0.45),
        min_length=1,
        max_length=15,
        description="rad; every template and every query is also tried turned by these",
    )
    shears: tuple[float, ...] = Field(
        default=(-0.2, 0.2),
        max_length=5,
        description="every template is also tried leaning sideways by so much of its height",
    )
    cuts: tuple[float, ...] = Field(
        default=(1.3,),
        max_length=5,
        description="palm radii from the palm's centre; every query is tried cut at each of these",
    )
    trims: tuple[float, ...] = Field(
        default=(0.0, 0.3),
        max_length=5,
        description="palm radii; every template is also tried with so much less wrist",
    )
    max_distance: float = Field(
        default=0.44,
        ge=0.0,
        le=2.0,
        description="farthest accepted match, root mean square over the features",
    )
    calibrate: bool = Field(
        default=True,
        description="lower max_distance, down to min_reach, by how far apart the enrolled "
        "templates are",
    )
    min_reach: float = Field(
        default=0.36, ge=0.0, le=2.0, description="a match as near as this is never too far"
    )
    landmark_max_distance: float = Field(
        default=0.44,
        ge=0.0,
        le=2.0,
        description="max_distance where hands are compared by their landmarks",
    )
    landmark_min_reach: float = Field(
        default=0.28, ge=0.0, le=2.0, description="min_reach where they are"
    )
    either_hand: bool = Field(
        default=True,
        description="a gesture taught with one hand is known of the other, too; by landmarks only",
    )
    min_margin: float = Field(
        default=0.03,
        ge=0.0,
        le=2.0,
        description="least lead over the second gesture, in the unit of the distance",
    )
    max_error: float = Field(
        default=0.5,
        ge=0.0,
        le=2.0,
        description="largest reconstruction error accepted, in the unit of the distance",
    )


class AgreementSettings(_Section):
    """From matches to gestures that start, hold and end."""

    votes: int = Field(default=3, ge=1, le=30, description="frames that must agree (N)")
    window: int = Field(default=4, ge=1, le=30, description="of the last so many frames (M)")
    settle_s: float = Field(
        default=0.15,
        ge=0.0,
        le=1.0,
        description="and for so long no frame may have shown another gesture, at any frame rate",
    )
    doubt_s: float = Field(
        default=0.05,
        ge=0.0,
        le=1.0,
        description="so much longer for a match that is barely accepted; for a clearer one in "
        "proportion less",
    )
    max_strangeness: float = Field(
        default=0.85,
        ge=0.0,
        le=1.0,
        description="a gesture starts only when its frames are in the mean no stranger than this; "
        "1 is what a match may be at most",
    )
    release_s: float = Field(
        default=0.15,
        ge=0.0,
        le=0.2,
        description="a held gesture ends when no frame has shown it for so long",
    )

    @model_validator(mode="after")
    def _enough_frames(self) -> Self:
        if self.votes > self.window:
            raise ValueError(f"votes ({self.votes}) must not exceed window ({self.window})")
        return self


class StillSettings(_Section):
    """What a photograph for enrolment may be."""

    max_bytes: int = Field(default=4 << 20, ge=1024, le=64 << 20, description="bytes of one file")
    max_pixels: int = Field(
        default=50_000_000, ge=4096, le=200_000_000, description="width times height"
    )
    working_side: int = Field(
        default=320, ge=64, le=2160, description="pixels; longer side after scaling down"
    )
    landmark_side: int = Field(
        default=960,
        ge=64,
        le=4096,
        description="pixels; the same of the picture in which landmarks are looked for",
    )


class QualitySettings(_Section):
    """Which photographs are refused at enrolment."""

    min_sharpness: float = Field(
        default=1.4,
        ge=0.0,
        le=3.0,
        description="how much finer a hand's picture must be than the same picture blurred; about "
        "1 is all blur; 0 refuses none",
    )
    min_palm: float = Field(
        default=7.0,
        ge=0.0,
        le=200.0,
        description="pixels after scaling down; smallest radius of the palm",
    )
    second_hand: float = Field(
        default=0.7,
        ge=0.0,
        le=2.0,
        description="a second thing whose palm has so many of the hand's palm radii is a second "
        "hand; 0 never is",
    )


class PipelineSettings(_Section):
    """From a picture to a gesture."""

    decode: DecodeSettings = DecodeSettings()
    smooth: SmoothSettings = SmoothSettings()
    normalise: NormaliseSettings = NormaliseSettings()
    binarise: BinariseSettings = BinariseSettings()
    landmarks: LandmarkSettings = LandmarkSettings()
    motion: MotionSettings = MotionSettings()
    roi: RoiSettings = RoiSettings()
    wrist: WristSettings = WristSettings()
    match: MatchSettings = MatchSettings()
    agreement: AgreementSettings = AgreementSettings()
    still: StillSettings = StillSettings()
    quality: QualitySettings = QualitySettings()


DEFAULT_PROFILE = "puma560"


class RobotSettings(_Section):
    """The robot node that the gateway starts."""

    id: str = Field(
        default="puma", pattern=r"^[a-z0-9-]{1,32}$", description="name of the robot on the link"
    )
    profile: str | None = Field(
        default=None,
        min_length=1,
        description="profile of the robot: puma560, kuka_iiwa, franka_panda, husky, or a file; "
        "default: puma560, or for a node that runs elsewhere what that one says",
    )
    spawn: bool = Field(default=True, description="start and supervise a robot node")
    endpoint: str | None = Field(
        default=None,
        description="Zenoh endpoint of a node that runs elsewhere; used when spawn is off",
    )


class ClearanceSettings(_Section):
    """How near an arm may come to things and to itself, and how hard it may touch."""

    slow: float = Field(
        default=0.10, gt=0.0, le=1.0, description="m; nearer than this, coming nearer is slowed"
    )
    stop: float = Field(
        default=0.020, ge=0.0, le=0.5, description="m; no link of the arm comes nearer to a thing"
    )
    stop_itself: float = Field(
        default=0.010, ge=0.0, le=0.5, description="m; no link comes nearer to another"
    )
    stop_hand: float = Field(
        default=0.004,
        ge=0.0,
        le=0.5,
        description="m; the fingers and what carries them come no nearer to what is fixed. A thing "
        "on a table is grasped near its middle, and with the arm's own distance the fingers would "
        "not reach below 20 mm; four times the 1 mm that a servo lags in a slow approach",
    )
    stop_held: float = Field(
        default=0.002,
        ge=0.0,
        le=0.5,
        description="m; what is held comes no nearer to other things: from here it is set down by "
        "letting go, and drops no farther than a book's cover is thick",
    )
    slow_workspace: float = Field(
        default=0.05,
        gt=0.0,
        le=1.0,
        description="m; nearer than this to the edge of its box, the tool is slowed",
    )
    slowest: float = Field(
        default=0.03, gt=0.0, le=1.0, description="part of the speed that slowing always leaves"
    )
    contact_force: float = Field(
        default=50.0,
        gt=0.0,
        le=1000.0,
        description="N; a contact that presses harder is a collision (S1). Below the 65 N that "
        "ISO/TS 15066 allows at the most sensitive part of a body (the face), and above the 25 N "
        "that the fingers press with when they push a light thing over a table",
    )


class ArmMotionSettings(_Section):
    """How a robot node moves its arm, in parts of the arm's own limits.

    A stop uses the whole of them: what ordinary motion leaves is what a stop needs to end within
    200 ms from any state (see ``app/robot/motion/limits.py``).
    """

    speed: float = Field(default=0.95, gt=0.0, le=0.95, description="part of the joint speeds")
    acceleration: float = Field(
        default=0.5, gt=0.0, le=0.5, description="part of the joint accelerations"
    )
    jerk: float = Field(default=0.5, gt=0.0, le=0.5, description="part of the joint jerks")
    linear_speed: float = Field(
        default=0.5, gt=0.0, le=1.0, description="m/s; fastest straight motion of the tool"
    )
    linear_acceleration: float = Field(default=1.5, gt=0.0, le=10.0, description="m/s^2")
    angular_speed: float = Field(
        default=1.5, gt=0.0, le=3.15, description="rad/s; fastest turn of the tool"
    )
    angular_acceleration: float = Field(default=5.0, gt=0.0, le=30.0, description="rad/s^2")
    ramp_jerk_s: float = Field(
        default=0.08,
        gt=0.0,
        le=1.0,
        description="s from no acceleration to the whole of it, in straight motion",
    )
    creep_s: float = Field(
        default=0.6,
        ge=0.0,
        le=5.0,
        description="s; straight motion while a gesture is held begins so long at a crawl, so that "
        "who shows it briefly moves the tool by a little",
    )
    creep: float = Field(
        default=0.25, ge=0.01, le=1.0, description="part of the speed asked for at that crawl"
    )
    slow_below: float = Field(
        default=0.10,
        gt=0.0,
        le=1.0,
        description="smallest singular value of the Jacobian below which straight motion slows",
    )
    following_error: float = Field(
        default=0.15,
        gt=0.0,
        le=1.0,
        description="rad between commanded and measured joint at which the arm counts as blocked",
    )
    clearance: ClearanceSettings = ClearanceSettings()
    planning_s: float = Field(
        default=8.0, gt=0.0, le=60.0, description="s; longest search for a way round things"
    )


class NodeSettings(_Section):
    """One robot node."""

    id: str = Field(
        default="puma", pattern=r"^[a-z0-9-]{1,32}$", description="name of the robot on the link"
    )
    profile: str = Field(
        default=DEFAULT_PROFILE,
        min_length=1,
        description="profile of the robot: puma560, kuka_iiwa, franka_panda, husky, or a file",
    )
    endpoint: str = Field(description="Zenoh endpoint to listen on, unixsock-stream/PATH")
    latch: Path | None = Field(
        default=None, description="file that keeps the latched stop over a restart"
    )
    stopped: str | None = Field(
        default=None,
        max_length=300,
        description="begin stopped for this reason, whatever the latch says: who starts the node "
        "knows that it was stopped",
    )
    cameras: bool = Field(default=True, description="start the camera process, too")
    dry_runs: bool = Field(default=True, description="start the process that checks programs, too")
    parent: int | None = Field(
        default=None,
        ge=1,
        description="process id of the one that starts the node; when that one is gone, however "
        "early, the node stops the arm and ends",
    )
    motion: ArmMotionSettings = ArmMotionSettings()


class GatewaySettings(_Section):
    """The server between the browsers and the robots."""

    allowed_hosts: tuple[str, ...] = Field(
        default=(),
        description="more host names that requests may be addressed to, and that the certificate "
        "made here holds. On loopback and with that certificate the machine's own names are always "
        "allowed, and no others; elsewhere (a certificate of yours, a proxy on another machine) "
        "none given means any",
    )
    max_message_bytes: int = Field(
        default=1 << 20,
        ge=64 * 1024,
        le=8 << 20,
        description="bytes of one WebSocket message; a longer one closes the connection (1009)",
    )
    max_upload_bytes: int = Field(
        default=4 << 20, ge=64 * 1024, le=64 << 20, description="bytes of one upload over REST"
    )
    max_burst_bytes: int = Field(
        default=16 << 20,
        ge=64 * 1024,
        le=64 << 20,
        description="bytes of one upload over REST that enrols a burst of frames",
    )
    max_import_bytes: int = Field(
        default=16 << 20,
        ge=64 * 1024,
        le=64 << 20,
        description="bytes of a gallery's file that is imported over REST",
    )
    max_bad_messages: int = Field(
        default=10, ge=1, le=1000, description="bad messages in a row that close a session (1007)"
    )
    max_sessions: int = Field(default=32, ge=1, le=1000, description="operators' sessions at once")
    max_observers: int = Field(
        default=100, ge=0, le=10_000, description="observers' sessions at once"
    )
    max_frame_age_ms: int = Field(
        default=500,
        ge=50,
        le=10_000,
        description="a frame whose sender had seen no newer server tick than this moves nothing",
    )
    frozen_ms: int = Field(
        default=500,
        ge=0,
        le=10_000,
        description="a live webcam whose pixels stay the same for this long is frozen: the arm "
        "holds still; 0 never is",
    )
    picture_age_ms: int = Field(
        default=1000,
        ge=0,
        le=60_000,
        description="who drives by a picture of the robot older than this, and says so, cannot see "
        "it: the arm holds still; 0 never",
    )
    workers: int = Field(
        default=2,
        ge=1,
        le=64,
        description="processes for pictures that were uploaded; jobs have two more, and learning a "
        "gallery one",
    )
    work_niceness: int = Field(
        default=5,
        ge=0,
        le=19,
        description="how far those processes stand back behind everything else on the machine; "
        "somebody who teaches a gesture waits for them",
    )
    work_mib: int = Field(
        default=1024,
        ge=256,
        le=65536,
        description="MiB of memory that a picture may take to work on; a gallery four times that",
    )
    max_uploads: int = Field(
        default=16,
        ge=1,
        le=1000,
        description="uploads over REST that are read or worked on at once; one more gets a 429",
    )
    body_s: float = Field(
        default=120.0,
        ge=1.0,
        le=3600.0,
        description="time that a request's whole body may take to arrive; who is not signed in "
        "has 10 s",
    )
    robot_rate_hz: float = Field(
        default=20.0, ge=10.0, le=60.0, description="robot messages a second to every session"
    )
    detail_rate_hz: float = Field(
        default=10.0, ge=1.0, le=30.0, description="masks and templates a second to a detail view"
    )
    robot_silence_ms: int = Field(
        default=200,
        ge=100,
        le=5000,
        description="no state for this long is shown as a fault; with the wait for the next robot "
        "message a hung node is shown within 300 ms",
    )
    robot_hung_ms: int = Field(
        default=1500,
        ge=500,
        le=60_000,
        description="a spawned node without a state for this long is killed and started again",
    )
    robot_start_s: float = Field(
        default=30.0, ge=1.0, le=300.0, description="time a spawned node has for its first state"
    )
    ready_wait_s: float = Field(
        default=10.0, ge=0.0, le=60.0, description="wait this long for the robot when starting"
    )
    lease_timeout_ms: int = Field(
        default=1000, ge=100, le=10_000, description="wait this long for the node's answer"
    )
    stop_confirm_ms: int = Field(
        default=300, ge=50, le=5000, description="a stop not confirmed after this is reported"
    )
    picture_wait_s: float = Field(
        default=2.0, ge=0.1, le=30.0, description="wait this long for a fresh camera picture"
    )
    viser: bool = Field(default=True, description="serve the live 3D view at /viser/")


class ConnectionSettings(_Section):
    """What those who are not signed in may take of the server, and how long anything may last.

    A connection counts as signed in once a request on it has brought a good token or cookie.
    """

    max_strangers: int = Field(
        default=256,
        ge=8,
        le=10_000,
        description="connections at once of those who are not signed in; fewer where the limit of "
        "open files leaves fewer. For one more the one that has been silent longest is closed",
    )
    max_per_address: int = Field(
        default=64,
        ge=1,
        le=10_000,
        description="the same from one address (of IPv6: one /64). An address from which somebody "
        "is signed in, and a proxy, may have as many as all",
    )
    begin_s: float = Field(
        default=10.0,
        gt=0.0,
        le=300.0,
        description="time from the connection, TLS handshake included, to the first byte asked",
    )
    head_s: float = Field(
        default=10.0,
        gt=0.0,
        le=300.0,
        description="time from the first byte of a request's head to its last",
    )
    body_s: float = Field(
        default=10.0,
        gt=0.0,
        le=300.0,
        description="time for the body of a request by somebody who is not signed in",
    )
    idle_s: float = Field(
        default=10.0,
        gt=0.0,
        le=300.0,
        description="time between two requests of somebody who is not signed in",
    )
    unread_s: float = Field(
        default=10.0,
        gt=0.0,
        le=300.0,
        description="time that somebody who is not signed in may leave an answer unread",
    )
    keep_alive_s: int = Field(
        default=30, ge=1, le=3600, description="time between two requests of who is signed in"
    )
    transfer_s: float = Field(
        default=300.0,
        gt=0.0,
        le=86_400.0,
        description="time for a body of who is signed in, and for an answer that is not read",
    )
    max_line_bytes: int = Field(
        default=8000,
        ge=256,
        le=8000,
        description="bytes of a request's target, and of one header with its name",
    )
    max_headers: int = Field(default=100, ge=10, le=120, description="headers of one request")
    max_head_bytes: int = Field(
        default=32 * 1024, ge=1024, le=1 << 20, description="bytes of a request's head"
    )
    requests_per_s: float = Field(
        default=20.0,
        gt=0.0,
        le=10_000.0,
        description="requests a second, in the long run, from one address without being signed in",
    )
    all_requests_per_s: float = Field(
        default=100.0, gt=0.0, le=10_000.0, description="the same from all addresses together"
    )
    begins_per_s: float = Field(
        default=50.0,
        ge=1.0,
        le=10_000.0,
        description="connections a second, in the long run, that may begin (a TLS handshake, a "
        "first request) without being signed in; others wait. Those of addresses from which "
        "somebody is signed in are counted apart",
    )
    burst_s: float = Field(
        default=5.0,
        ge=1.0,
        le=60.0,
        description="so many seconds' worth of requests may come at once",
    )


class MemorySettings(_Section):
    """What the server remembers of what happened."""

    events: int = Field(
        default=5000, ge=100, le=1_000_000, description="events that the timeline keeps at most"
    )
    bytes: int = Field(
        default=32 << 20,
        ge=1 << 20,
        le=4 << 30,
        description="bytes of events with their pictures that the timeline keeps at most",
    )


def _data_dir() -> Path:
    base = os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share"
    return Path(base) / "farhand"


class Settings(BaseSettings):
    """Everything that can be set from outside."""

    model_config = SettingsConfigDict(
        env_prefix="FARHAND_", env_nested_delimiter="__", extra="forbid", frozen=True
    )

    host: str = Field(default="127.0.0.1", description="address to listen on")
    port: int = Field(default=8000, ge=0, le=65535, description="port; 0 picks a free one")
    data_dir: Path = Field(default_factory=_data_dir, description="where everything is kept")
    token: SecretStr | None = Field(
        default=None, description="secret that opens the page and the API; made when not given"
    )
    token_file: Path | None = Field(
        default=None, description="file that holds it, which nobody else can read"
    )
    tls_cert: Path | None = Field(default=None, description="certificate chain (PEM) for HTTPS")
    tls_key: Path | None = Field(default=None, description="private key (PEM) of the certificate")
    behind_proxy: bool = Field(
        default=False,
        description="a proxy in front serves HTTPS; allows plain HTTP off loopback, from "
        "proxy_addresses alone",
    )
    proxy_addresses: tuple[IPvAnyNetwork | Literal["gateway"], ...] = Field(
        default=(IPv4Network("127.0.0.0/8"), IPv6Network("::1/128")),
        min_length=1,
        description="addresses or networks of the proxy in front; nobody else is answered, and "
        "the last entry of its X-Forwarded-For is believed; 'gateway' is this machine's way out, "
        "by which a container is reached from its host",
    )
    root_path: str = Field(
        default="",
        pattern=r"^((/[A-Za-z0-9._~-]+)+)?$",
        description="path below which a proxy shows this server, such as /farhand",
    )
    database_url: str | None = Field(
        default=None, description="SQLAlchemy URL; default: SQLite in the data folder"
    )
    backups: int = Field(
        default=5,
        ge=0,
        le=1000,
        description="backups of an SQLite gesture database that are kept in the data folder; 0 "
        "makes none",
    )
    pipeline: PipelineSettings = PipelineSettings()
    robot: RobotSettings = RobotSettings()
    gateway: GatewaySettings = GatewaySettings()
    connections: ConnectionSettings = ConnectionSettings()
    memory: MemorySettings = MemorySettings()
