#pragma once

#include "experiments/study/recorded_instances.hpp"

namespace solenoid::test {

using solenoid::actuator_problem;
using solenoid::record_closed_loop;
using solenoid::RecordedInstance;

}  // namespace solenoid::test
