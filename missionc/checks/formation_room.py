"""x"""


def nowhere(ground, formation):
    return None
