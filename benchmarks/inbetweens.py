# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Quality of in-betweens: QC3D, the straight blend, and other methods.

    python -m benchmarks.inbetweens                                   # every pair, every method, resumed
    python -m benchmarks.inbetweens --pairs body:rest:t_pose bar:straight:bend180 --methods straight natural
    python -m benchmarks.inbetweens --listed --check                  # exit status 1 where `natural` falls short
    python -m benchmarks.inbetweens --listed --write          # the tables and sheets of docs/science/inbetweens.md

The environment variables QC3D_PAIRS and QC3D_DATA say where the list of pairs and the shapes are. Results are stored in
a folder, one for each pair and method, and computed again when the sources that they depend on have changed.
"""

import os
import sys

if __name__ == "__main__":
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(variable, "1")  # before numpy loads: the processes share the cores
    from .runner import main

    sys.exit(main(description=__doc__))
