#include "core/config/reader.hpp"

#include <solenoid/controllers/factory.hpp>
#include <solenoid/core/config/reader.hpp>

static_assert(parents_own == 1);

double payload_of(const char* file) { return solenoid::TableReader::from_file(file).number("payload_kg"); }
