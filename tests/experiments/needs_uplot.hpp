// Reports and the live page draw with uPlot, which the program embeds when npm has brought it.
#pragma once

#include "experiments/base/embedded.hpp"

#include <gtest/gtest.h>

#define NEEDS_UPLOT()                                   \
  if (embedded_text("uplot/uPlot.iife.min.js").empty()) \
  GTEST_SKIP() << "needs uPlot at build time: apt-get install npm, npm ci in the project's folder, build again"
