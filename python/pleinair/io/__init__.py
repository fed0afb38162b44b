"""Files: photographs, pictures, volumes. All are written beside their place and renamed: nothing is half-written."""

from .exif import PhotoFacts, photo_facts
from .files import DAMAGE as DAMAGE
from .files import PathLike as PathLike
from .files import UnreadableError
from .files import read_array as read_array
from .files import read_arrays as read_arrays
from .files import replacing as replacing
from .files import write_arrays as write_arrays
from .layers import read_layers, write_layers
from .meshes import MeshMaterial as MeshMaterial
from .meshes import MeshPart as MeshPart
from .meshes import write_mesh as write_mesh
from .photographs import pillow as pillow
from .photographs import read
from .pictures import nearest_levels as nearest_levels
from .pictures import write
from .video import film as film
from .video import frame_count as frame_count
from .video import frame_time as frame_time
from .video import write_video
from .volumes.arrays import foreign_arrays as foreign_arrays
from .volumes.arrays import raw_array as raw_array
from .volumes.mitsuba import read_vol as read_vol
from .volumes.mitsuba import write_vol as write_vol
from .volumes.netcdf import is_dataset as is_dataset
from .volumes.netcdf import read_les as read_les
from .volumes.openvdb import read_vdb as read_vdb
from .volumes.shdom import read_shdom as read_shdom

__all__ = [
    "PhotoFacts",
    "UnreadableError",
    "photo_facts",
    "read",
    "read_layers",
    "write",
    "write_layers",
    "write_video",
]
