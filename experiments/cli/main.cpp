#include "experiments/cli/commands.hpp"

int main(int argc, char** argv) { return solenoid::run_program(argc, argv); }
