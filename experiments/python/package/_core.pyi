# What of the C++ half is for everybody, __init__.pyi describes; the rest is the package's own.
from typing import Any

def __getattr__(name: str) -> Any: ...
