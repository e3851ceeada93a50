"""What a run leaves behind: pictures, numbers, tables on the terminal."""
