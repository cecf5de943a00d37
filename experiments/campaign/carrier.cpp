#include "experiments/campaign/carrier.hpp"

#include "experiments/base/files.hpp"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

namespace solenoid {

Carried Carrier::carry(const Document& document) {
  Carried carried{document.root(), document.root(), {}};
  rewrite(carried.table, carried.key, document, carried.files);
  return carried;
}

void Carrier::rewrite(toml::table& moved, toml::table& keyed, const Document& document, std::vector<InputFile>& files) {
  for (auto&& [key, node] : moved) {
    if (toml::table* inner = node.as_table()) rewrite(*inner, *keyed[key].as_table(), document, files);
    const auto* text = node.as_string();
    if (!text || !(text->get().ends_with(".csv") || text->get().ends_with(".toml"))) continue;
    const auto content = document.linked(text->get());
    if (!content) continue;
    const std::string hash = fingerprint(*content);
    keyed.insert_or_assign(key, "content " + hash);
    files.push_back({add(text->get(), hash, *content), *content});
    moved.insert_or_assign(key, files.back().name);
  }
}

std::string Carrier::add(const std::string& path, const std::string& hash, const std::string& content) {
  const std::filesystem::path file(path);
  std::string stem = file.stem().string();
  if (const std::string tail = "-" + hash; stem.ends_with(tail)) stem.resize(stem.size() - tail.size());
  std::string name = fmt::format("inputs/{}-{}{}", stem, hash, file.extension().string());
  if (std::none_of(inputs_.begin(), inputs_.end(), [&](const InputFile& f) { return f.name == name; }))
    inputs_.push_back({name, content});
  return name;
}

}  // namespace solenoid
