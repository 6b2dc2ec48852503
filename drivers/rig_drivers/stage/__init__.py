"""What every serial stage shares: line, dialogue, travel, and the stage itself."""
