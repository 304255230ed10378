//! The law of a part as the library wants it: rates, slopes and where it begins.

use diffsol::{
    ConstantOp, NalgebraContext, NalgebraVec, NonLinearOp, NonLinearOpJacobian, OdeEquations, OdeEquationsRef, Op,
    UnitCallable, Vector, VectorCommon,
};

use super::integrator::Field;
use super::shifted::Shifted;

/// The equations of a field, from `initial` on.
pub(super) struct Equations<'f> {
    pub(super) field: &'f Field,
    pub(super) initial: &'f [f64],
    pub(super) context: NalgebraContext,
}

/// Their rates.
pub(super) struct Rates<'e>(&'e Equations<'e>);

/// Their beginning.
pub(super) struct Beginning<'e>(&'e Equations<'e>);

macro_rules! sized {
    ($type:ty, $own:ident => $equations:expr) => {
        impl Op for $type {
            type T = f64;
            type V = NalgebraVec<f64>;
            type M = Shifted;
            type C = NalgebraContext;

            fn context(&self) -> &NalgebraContext {
                let $own = self;
                &$equations.context
            }

            fn nstates(&self) -> usize {
                let $own = self;
                $equations.initial.len()
            }

            fn nout(&self) -> usize {
                self.nstates()
            }

            fn nparams(&self) -> usize {
                0
            }
        }
    };
}

sized!(Equations<'_>, own => own);
sized!(Rates<'_>, own => own.0);
sized!(Beginning<'_>, own => own.0);

impl NonLinearOp for Rates<'_> {
    fn call_inplace(&self, x: &NalgebraVec<f64>, t: f64, out: &mut NalgebraVec<f64>) {
        self.0.field.rate(x.inner().as_slice(), t, out.inner_mut().as_mut_slice());
    }
}

impl NonLinearOpJacobian for Rates<'_> {
    fn jac_mul_inplace(&self, x: &NalgebraVec<f64>, t: f64, direction: &NalgebraVec<f64>, out: &mut NalgebraVec<f64>) {
        self.0.field.slope(x.inner().as_slice(), t, direction.inner().as_slice(), out.inner_mut().as_mut_slice());
    }

    fn jacobian_inplace(&self, x: &NalgebraVec<f64>, t: f64, matrix: &mut Shifted) {
        self.0.field.slopes(x.inner().as_slice(), t, matrix);
    }
}

impl ConstantOp for Beginning<'_> {
    fn call_inplace(&self, _: f64, out: &mut NalgebraVec<f64>) {
        out.inner_mut().as_mut_slice().copy_from_slice(self.0.initial);
    }
}

impl<'a> OdeEquationsRef<'a> for Equations<'_> {
    type Mass = UnitCallable<Shifted>;
    type Rhs = Rates<'a>;
    type Root = UnitCallable<Shifted>;
    type Init = Beginning<'a>;
    type Out = UnitCallable<Shifted>;
    type Reset = UnitCallable<Shifted>;
}

impl OdeEquations for Equations<'_> {
    fn rhs(&self) -> Rates<'_> {
        Rates(self)
    }

    fn mass(&self) -> Option<UnitCallable<Shifted>> {
        None
    }

    fn init(&self) -> Beginning<'_> {
        Beginning(self)
    }

    fn set_params(&mut self, _: &NalgebraVec<f64>) {}

    fn get_params(&self, _: &mut NalgebraVec<f64>) {}
}
