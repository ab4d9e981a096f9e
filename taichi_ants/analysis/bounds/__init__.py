"""What no ant and no colony can exceed, and simple policies, to hold learned ones against."""
