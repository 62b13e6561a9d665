"""A page to turn the display in the hands, and a model of it for other programs.

The display is drawn with its images on: from the viewer's eye the picture holds, and breaks as one
leaves it.
"""

from quiltcli.exchange.web.files import Written, view
from quiltcli.exchange.web.frames import ViewOptions

__all__ = ["ViewOptions", "Written", "view"]
