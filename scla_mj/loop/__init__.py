"""The loop: sense, think, decide, command, step physics, record. It joins the stages that do not know one another."""
