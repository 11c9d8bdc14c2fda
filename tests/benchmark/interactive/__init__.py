from tests.support.blender_folder import use_own_folder

use_own_folder()  # before any module of this package loads Blender
