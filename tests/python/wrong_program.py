"""What mypy has to find: an error in each line that says so."""

import solenoid

solenoid.simulate("thesis_pd", 7)  # error: arg-type
solenoid.compare(["thesis_pd"], seeds="many")  # error: arg-type
solenoid.PythonController("mine")  # error: call-arg
solenoid.variant("thesis_pd").colours()
solenoid.scenario("task").duration_s + "s"  # error: operator
solenoid.no_such_function()  # error: attr-defined
