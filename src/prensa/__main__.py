"""``python -m prensa`` is the command ``prensa``."""

from prensa.cli import main

if __name__ == "__main__":
    main()
