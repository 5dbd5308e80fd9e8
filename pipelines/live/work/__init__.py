"""The threads of a node: queues, schedules, and memory."""
