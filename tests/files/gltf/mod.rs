//! Reading glTF and GLB, and writing them back with ambient occlusion, from outside: files made by hand.

mod broken;
mod hostile;
mod making;
mod occlusion;
mod posing;
mod reading;
mod spoiling;
mod tolerance;
mod validator;
