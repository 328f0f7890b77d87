"""The part of SciPy that the live page needs. SciPy has no build for Pyodide in the registries that the live page is
made from; what needs more of it says so (``ModuleNotFoundError``), and the page shows that."""
