"""``python -m lampyris``: the command line, where no script of that name is on the path."""

from lampyris.cli import program

if __name__ == "__main__":
    program()
