#include "tests/support/tracking_sqp.hpp"

template class solenoid::Sqp<solenoid::test::TrackingSlide, 2, 0>;
