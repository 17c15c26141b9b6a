//! The Python environment of the external serial client: a client that shares no code with this project.

use crate::venv::Venv;

/// It.
pub const VENV: Venv = Venv {
    folder: "target/pyserial-venv",
    packages: "pyserial==3.5",
    imports: "serial",
    variable: "PYSERIAL_PYTHON",
    without: "the external-client test is left out",
};
