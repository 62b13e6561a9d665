"""`python -m quiltcli` is the same program as `quilt`."""

from quiltcli.cli import main

if __name__ == "__main__":
    main()
