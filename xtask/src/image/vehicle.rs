//! The vehicles that there is an image for.

use clap::ValueEnum;

/// Chosen when the image is built.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Vehicle {
    /// Two driven wheels on one axis
    #[default]
    Differential,
    /// Wheels that steer together
    Synchro,
    /// A front wheel, driven and steered
    Tricycle,
    /// Steered front and rear wheels, or an ordinary car
    Bisteerable,
}

impl Vehicle {
    /// As its feature is called, and its image.
    pub fn name(self) -> &'static str {
        match self {
            Self::Differential => "differential",
            Self::Synchro => "synchro",
            Self::Tricycle => "tricycle",
            Self::Bisteerable => "bisteerable",
        }
    }

    /// The simulator's robot of this kind.
    pub fn robot(self) -> &'static str {
        match self {
            Self::Differential => "default",
            Self::Synchro => "synchro",
            Self::Tricycle => "tricycle",
            Self::Bisteerable => "cycab",
        }
    }

    /// What one says to cargo to get its firmware. The differential drive's has no code of the others.
    pub fn package(self) -> String {
        let mut package = "--package vehicle-controller --bin vehicle-controller --no-default-features --features nucleo-f429zi".to_owned();
        if self != Self::Differential {
            package.push(',');
            package.push_str(self.name());
        }
        package
    }

    /// What the files of its image are called, without the extension.
    pub fn file(self) -> String {
        match self {
            Self::Differential => "vehicle-controller".to_owned(),
            other => format!("vehicle-controller-{}", other.name()),
        }
    }
}
