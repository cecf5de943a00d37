#pragma once

#include "controllers/systems.hpp"
#include "controllers/variant.hpp"
#include "experiments/campaign/run_list.hpp"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace solenoid {

class Document;

/// What the command line takes from a campaign; empty: all of it. A variant may be any that is known, in the campaign's
/// list or not.
struct Selection {
  std::vector<std::string> variants{};
  std::vector<std::string> scenarios{};  ///< tables, or of one with `ensemble` single members
  std::string model = {};                ///< a parameter set's name or file in place of every variant's own
  bool loads_plugins = true;  ///< whether the campaign may have files of plug-ins loaded: not what came with results
  bool leaves_out = false;    ///< whether what needs a refused plug-in is left out; otherwise the campaign is refused
};

/// What a campaign goes without.
struct WithoutPlugins {
  std::vector<std::string> plugins;  ///< why each was refused
  std::vector<std::string> names;    ///< of the variants and scenarios that cannot be read without
};

/// A file that a variant or scenario names, carried along so that results stay reproducible from their folder.
struct InputFile {
  std::string name;  ///< below the results folder
  std::string text;
};

/// Variants crossed with scenarios and seeds, read and checked.
struct Campaign {
  std::string name;
  const System* system = nullptr;  ///< whose variants and scenarios they are
  std::vector<VariantConfig> variants;
  ScenarioList scenarios;
  std::vector<std::uint64_t> seeds;
  RunList runs;                              ///< all of them
  std::shared_ptr<const Document> resolved;  ///< the same campaign in one document, `inputs` carried
  std::string resolved_toml;                 ///< its text, which needs `inputs` beside it
  std::vector<InputFile> inputs;
  std::string maker;  ///< the program and the plug-ins that make its results: others' are other results
  WithoutPlugins without{};
};

/// Of everything that a campaign's results depend on: its runs, and who makes them.
std::string identity_of(const Campaign& campaign);

/// The control period of a campaign's first variant in its first scenario [s].
double period_of(const Campaign& campaign);

/// Reads a campaign file; `path` may also name a shipped one ("default"). Keys:
///
///   name            text, default the file's stem
///   plugins         files of plug-ins, relative to this one, or names of those that are loaded
///   include         other TOML files, relative to this one, or shipped ones by name
///   variants        names of shipped, included or own variants
///   seeds           whole numbers, default [1]
///   [[scenario]]    tasks; those of included files come first; one with `ensemble` stands for as many as it draws, of
///                   which the first 1000 are read and checked now, and the ends of the intervals
///   [variant.NAME]  own variants; they override included and shipped ones
///
/// An included file lends its variants and scenarios, and its `variants` and `seeds` where this file has none.
/// Throws ConfigError with file, line, key and what is allowed.
Campaign read_campaign(const std::string& path, const Selection& selection = {});

/// The same of a document in memory; files are carried with it or relative to its name.
Campaign read_campaign(Document document, const Selection& selection = {});

/// The one cell that a variant runs in real time. An empty campaign: the variant's system's own, for which it must be a
/// shipped one; an empty scenario: the campaign's first.
Campaign read_real_time_task(const std::string& campaign, const std::string& variant, const std::string& scenario);

/// The variants known by name everywhere, in the order of the shipped files.
std::vector<VariantConfig> shipped_variants();

/// A shipped variant by name. Throws ConfigError naming those there are.
VariantConfig shipped_variant(const std::string& name);

/// Names of the shipped campaigns: files with scenarios.
std::vector<std::string> shipped_campaigns();

}  // namespace solenoid
