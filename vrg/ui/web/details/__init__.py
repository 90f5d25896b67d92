"""What the page's drawer shows to officials: everything about players, referee, streams and processes."""
