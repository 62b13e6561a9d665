"""`python -m quiltcli` is the same program as `quilt`."""

from quiltcli.cli import run

if __name__ == "__main__":
    run()
