"""OpenGL floor: context, shaders, uniform blocks, state, timers; knows nothing of spacecraft."""
