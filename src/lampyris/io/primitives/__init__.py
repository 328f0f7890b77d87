"""Files of motion primitives: Nav2's JSON and SBPL's ``.mprim``, read and written."""
