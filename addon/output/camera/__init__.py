"""A camera's pass as pictures: what it holds, its noise taken out, and its file."""

from .denoising import denoised
from .exr import FILE, GROUP_LAYER, LAYER, SCENE, PictureFrame, frame_path, origin_of, write_camera_pass
from .passes import CameraPass

__all__ = [
    "FILE",
    "GROUP_LAYER",
    "LAYER",
    "SCENE",
    "CameraPass",
    "PictureFrame",
    "denoised",
    "frame_path",
    "origin_of",
    "write_camera_pass",
]
