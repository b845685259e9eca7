"""`python -m bayesimpact`: the same as the command."""

from bayesimpact.cli import main

if __name__ == "__main__":
    main(prog_name="bayesimpact")
