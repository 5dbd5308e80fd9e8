from .config import LocalizationConfig as LocalizationConfig
from .localizer import Localizer as Localizer
from .pose_estimate import PoseEstimate as PoseEstimate
