#pragma once

#include "solvers/learned/mlp.hpp"

#include <memory>
#include <string>
#include <string_view>

namespace solenoid {

class TableReader;
struct VariantConfig;

/// Networks that variants name: shipped ones by name, others by the file that they are in, NAME.toml. Whoever reads a
/// variant takes in its file; solvers are made from what was taken in, wherever they are made.

/// Who knows the texts of shipped networks by name, and nothing (an empty text) of others: a program's, told at its
/// start. The first counts: a shared object that is loaded and unloaded later may have the same code and tell it again.
void ship_networks(std::string_view (*text_of)(std::string_view name)) noexcept;

/// Whether a variant's `learned.network` is a file and no shipped name.
bool is_network_file(std::string_view network);

/// Takes in the text of a file of this path, in the place of what was taken in before. Throws ConfigError for one that
/// is no network.
void take_in_network(const std::string& path, const std::string& text);

/// The same of what a command line names: reads the file; a name that is no file's is left alone. Throws ConfigError.
void take_in_network_file(const std::string& network);

/// A network that was taken in or is shipped. Throws ConfigError, naming what is allowed.
std::shared_ptr<const Mlp> find_network(const std::string& network);

/// Takes in the network of a variant under its table and tries whether its solver can use it; a variant without one
/// passes. Throws by table.fail() what is wrong with it.
void check_network(TableReader& table, const VariantConfig& variant);

}  // namespace solenoid
