"""Pictures and videos of bodies and scenes, without OpenGL."""
