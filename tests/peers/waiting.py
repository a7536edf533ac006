"""How every test waits for another process."""
import time


def wait_until(condition, what, seconds=60, every_s=0.02):
    """The condition's first value that counts as true; an AssertionError that names `what` after so many seconds."""
    give_up = time.monotonic() + seconds
    while time.monotonic() < give_up:
        value = condition()
        if value:
            return value
        time.sleep(every_s)
    raise AssertionError(f"not within {seconds} s: {what}")
