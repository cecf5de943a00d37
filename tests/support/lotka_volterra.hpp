#pragma once

#include "experiments/study/lotka_volterra.hpp"
