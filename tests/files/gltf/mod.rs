//! Reading glTF and GLB, and writing them back with ambient occlusion, from outside: files made by hand.

mod broken;
mod making;
mod occlusion;
mod reading;
mod spoiling;
mod tolerance;
mod validator;
