"""The loop: sense, think, decide, command, step physics, record. It joins the stages that do not know one another."""

from scla_mj import world as world  # imports MuJoCo, whatever OpenGL the environment asks for
