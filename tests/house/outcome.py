"""How a test of the house ends: what is wrong, a line each, or that nothing is; a test that has seen too little looks in the wrong
place and fails."""


def conclude(wrong, seen, fewest, what):
    """Prints it; the exit status. `what`: of the things seen, "sources keep to the directions"."""
    if seen < fewest:
        wrong = [*wrong, f"only {seen} seen, {fewest} at least are there: the test looks in the wrong place"]
    print("\n".join(wrong) or f"{seen} {what}")
    return 1 if wrong else 0
