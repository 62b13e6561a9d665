"""Two eyes' images as stereo hardware takes them: anaglyphs, packings, interleavings, sequences."""
