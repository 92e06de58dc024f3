//! Statistics, quadrature, exact enumeration and planted faults for tests of estimators.
