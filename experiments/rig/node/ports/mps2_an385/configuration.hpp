#pragma once

#include "experiments/rig/node/packet.hpp"

#include <cstdint>

/// What somebody who flashes this image for another network or another line changes.
namespace solenoid::mps2 {

inline constexpr std::uint32_t ip_address = 10u << 24 | 0u << 16 | 2u << 8 | 15u;  ///< 10.0.2.15
inline constexpr std::uint16_t udp_port = node_port;
inline constexpr std::uint32_t baud_rate = 115'200;

/// Not fed for so long: the watchdog makes the outputs safe and resets the board; after twice that the chip does,
/// whatever the program does.
inline constexpr std::uint32_t watchdog_us = 20'000;

/// How often the node tells of itself in the board's memory.
inline constexpr std::uint32_t report_us = 500'000;

}  // namespace solenoid::mps2
