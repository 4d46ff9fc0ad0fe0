"""A camera's pass as pictures: what it holds, its noise taken out, and its file."""

from .denoising import denoised
from .exr import LAYER, PictureFrame, frame_path, write_camera_pass
from .passes import CameraPass

__all__ = ["LAYER", "CameraPass", "PictureFrame", "denoised", "frame_path", "write_camera_pass"]
