#include "experiments/rig/node_attack.hpp"

#include "core/rt/clock.hpp"
#include "experiments/base/bounded_json.hpp"
#include "experiments/base/child_process.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/result.hpp"
#include "experiments/rig/node/bytes.hpp"
#include "experiments/rig/node_protocol.hpp"
#include "experiments/rig/packet_tap.hpp"

#include <array>
#include <csignal>
#include <filesystem>
#include <functional>
#include <random>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/socket.h>
#include <unistd.h>

namespace solenoid {
namespace {

constexpr double before_s = 1.0, after_s = 1.5;  // of a run, around the attack
constexpr double longest_wait_s = 30.0;
constexpr double burst_s = 1e-3;

/// What an attacker has to go by, and where its packets go.
struct Attacker {
  PacketTap& tap;
  int stranger;                       ///< a socket of its own
  std::vector<std::string> recorded;  ///< packets of the controller's, of this session
  std::vector<std::string> earlier;   ///< of a session before it
  std::mt19937_64 random{1};
  std::int64_t sent = 0, no_packets = 0;

  /// From the controller's address, or from another.
  void send(const std::string& bytes, bool tagged) {
    const bool done =
        toss() ? tap.inject(bytes) : ::send(stranger, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL) >= 0;
    sent += done ? 1 : 0;
    no_packets += done && !tagged ? 1 : 0;
  }
  bool toss() { return random() % 2 == 0; }
  const std::string& any(const std::vector<std::string>& all) { return all[random() % all.size()]; }
  /// A packet of the present session, newer than the controller's newest, that says what the attacker wants.
  NodePacket wanted() {
    NodePacket p(toss() ? NodePacket::Type::command : NodePacket::Type::safe);
    const std::string newest = tap.newest();
    p.session = take_little_endian<std::uint64_t>(newest.data() + 8);
    p.sequence = take_little_endian<std::uint64_t>(newest.data() + 16) + 1 + (toss() ? random() % 3 : 100'000);
    p.time_us = take_little_endian<std::uint64_t>(newest.data() + 24);
    if (p.type == NodePacket::Type::command) NodeCommand{0b0101, {5'000'000}, tap.node_time_us()}.put(p, 1);
    return p;
  }
};

std::string bytes_of(const NodePacket& packet, const NodeKey* key) {
  std::array<char, NodePacket::most_size> room;
  return {room.data(), packet.encode(room, key)};
}

/// One packet of an attack.
struct Attack {
  const char* name;
  std::function<void(Attacker&)> packet;
};

void open_too(Attacker& a) {
  NodePacket p(a.toss() ? NodePacket::Type::hello : NodePacket::Type::open);
  p.session = a.random();
  if (p.type == NodePacket::Type::hello) p.append(std::string_view("actuator"));
  a.send(bytes_of(p, nullptr), false);
}

void replay(Attacker& a) { a.send(a.any(a.recorded), true); }

void replay_earlier(Attacker& a) { a.send(a.any(a.earlier), true); }

void forge_crc(Attacker& a) { a.send(bytes_of(a.wanted(), nullptr), false); }

void forge_tag(Attacker& a) {
  std::string bytes = bytes_of(a.wanted(), nullptr);
  for (std::size_t i = bytes.size() - NodePacket::tag_size; i < bytes.size(); ++i)
    bytes[i] = static_cast<char>(a.random());
  a.send(bytes, false);
}

void flood(Attacker& a) {
  switch (a.random() % 4) {
    case 0:
      a.send(std::string(a.random() % (2 * NodePacket::most_size), 'x'), false);
      return;
    case 1:
      return a.toss() ? replay(a) : replay_earlier(a);
    case 2:
      return a.toss() ? forge_crc(a) : forge_tag(a);
    default:
      return open_too(a);
  }
}

const std::vector<Attack>& attacks() {
  static const std::vector<Attack> all = {
      {"nothing", {}},           {"open", open_too},        {"replay", replay},     {"another session", replay_earlier},
      {"forged CRC", forge_crc}, {"forged tag", forge_tag}, {"flood of all", flood}};
  return all;
}

/// Sends an attack's packets evenly for its time.
void strike(const Attack& attack, const AttackSettings& settings, Attacker& attacker, AttackOutcome& out) {
  MonotonicClock clock;
  const double begun_s = clock.now_s();
  std::int64_t due = 0;
  for (double now_s = begun_s; now_s - begun_s < settings.seconds; now_s = clock.now_s()) {
    const auto wanted = static_cast<std::int64_t>(settings.per_s * (now_s - begun_s));
    for (; attack.packet && due < wanted; ++due) attack.packet(attacker);
    clock.sleep_until(now_s + burst_s);
  }
  out.sent = attacker.sent;
  out.no_packets = attacker.no_packets;
  out.per_s = static_cast<double>(attacker.sent) / (clock.now_s() - begun_s);
}

std::string make_key(const std::string& path) {
  write_file_atomically(path, fmt::format("{:016x}{:016x}\n", unguessable_number(), unguessable_number()));
  std::filesystem::permissions(path, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  return path;
}

void look_at_reports(const std::string& node, const std::string& run, AttackOutcome& out) {
  const auto node_text = read_whole_file(node), run_text = read_whole_file(run);
  if (!node_text || !run_text) {
    out.problem = fmt::format("{} left no report", node_text ? "the run" : "the node");
    return;
  }
  const auto seen = parse_json(*node_text, node);
  for (const auto& [key, count] : {std::pair("packets", &out.packets),
                                   {"dropped", &out.dropped},
                                   {"counted", &out.counted},
                                   {"sessions", &out.sessions},
                                   {"invalid_packets", &out.invalid},
                                   {"old_packets", &out.old},
                                   {"foreign_packets", &out.foreign},
                                   {"asked", &out.asked},
                                   {"offers", &out.offers},
                                   {"commands", &out.commands},
                                   {"refused", &out.refused},
                                   {"timeouts", &out.timeouts}})
    *count = seen.at(key);
  const auto done = parse_json(*run_text, run).at("runs").at(0);
  out.ticks = done.at("loop").at("ticks");
  out.skipped = done.at("loop").at("skipped");
  out.missed = done.at("io").at("missed");
  out.causes = done.at("safe_causes");
}

AttackOutcome attacked(const Attack& attack, const AttackSettings& settings, int port) {
  AttackOutcome out;
  out.name = attack.name;
  const std::string here = fmt::format("{}/{}", settings.folder, port), report = here + "-node.json";
  const std::string key = make_key(here + ".key"), words = here + "-node.txt";
  const auto with_key = [&](std::vector<std::string> arguments) {
    if (settings.keyed) arguments.insert(arguments.end(), {"--key", key});
    return arguments;
  };
  Child emulator(
      settings.program,
      with_key({"emulator", "--variant", settings.variant, "--port", std::to_string(port + 1), "--report", report}),
      words);
  wait_until([&] { return read_whole_file(words).value_or("").find("on 127.0.0.1:") != std::string::npos; },
             longest_wait_s);
  PacketTap tap(port, port + 1);
  const auto reach = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--plant", "emulator", "--node", fmt::format("127.0.0.1:{}", port)});
    return with_key(std::move(arguments));
  };
  Child look(settings.program, reach({"check"}), here + "-check.txt");  // the session before
  look.wait(longest_wait_s);
  Attacker attacker{tap, loopback_socket(0, port + 1), {}, tap.recorded()};
  const double seconds = before_s + settings.seconds + after_s;
  const std::int64_t before = tap.commands();
  Child run(settings.program,
            reach({"run", settings.variant, "--duration", fmt::format("{}", seconds), "--out", here, "--quiet",
                   "--format", "json"}),
            here + "-run.json");
  wait_until([&] { return tap.commands() > before + 100; }, longest_wait_s);
  wait_s(before_s);
  attacker.recorded = tap.recorded();
  if (attacker.recorded.empty() || attacker.earlier.empty()) {
    out.problem = "nothing came by that could be played again";
  } else {
    const std::string session = attacker.recorded.back().substr(8, 8);
    std::erase_if(attacker.recorded, [&](const std::string& p) { return p.compare(8, 8, session) != 0; });
    strike(attack, settings, attacker, out);
  }
  out.exit_code = run.wait(seconds + longest_wait_s);
  emulator.send(SIGINT);
  out.node_exit_code = emulator.wait(longest_wait_s);
  ::close(attacker.stranger);
  out.forwarded = tap.forwarded();
  out.commanded = tap.commands();
  if (out.problem.empty()) look_at_reports(report, here + "-run.json", out);
  out.expected_ticks = static_cast<std::int64_t>(1e3 * seconds);
  return out;
}

}  // namespace

std::vector<AttackOutcome> attack_node(const AttackSettings& settings) {
  std::vector<AttackOutcome> table;
  int port = 20000 + 2 * (::getpid() % 10000);
  for (const Attack& attack : attacks()) {
    if (!settings.only.empty() && settings.only != attack.name) continue;
    table.push_back(attacked(attack, settings, port));
    port += 2;
  }
  return table;
}

bool withstood(const AttackOutcome& o) {
  constexpr std::int64_t sessions = 2;  // who looked before, and the run
  return o.problem.empty() && o.not_obeyed() >= 0 && o.refused == 0 && o.sessions == sessions && o.uncounted() == 0 &&
         o.packets == o.counted && o.invalid >= o.no_packets - o.dropped;
}

Result result_of(const std::vector<AttackOutcome>& attacks) {
  using Column = Table::Column;
  Table table{
      .name = "attacks",
      .columns = {Column("attack", "attack", "<"), Column("sent", "packets"), Column("per_s", "a second", ".0f"),
                  Column("no_packets", "without tag"), Column("invalid", "invalid"), Column("old", "old"),
                  Column("foreign", "foreign"), Column("asked", "asked too"), Column("offers", "offers"),
                  Column("dropped", "dropped"), Column("uncounted", "uncounted"), Column("commanded", "commands sent"),
                  Column("commands", "obeyed"), Column("timeouts", "timeouts"), Column("ticks", "ticks"),
                  Column("skipped", "skipped"), Column("missed", "missed reads"), Column("exit_code", "run's exit"),
                  Column("safe_causes", "why SAFE", "<")}};
  for (const AttackOutcome& o : attacks)
    table.add({o.name, o.sent, o.per_s, o.no_packets, o.invalid, o.old, o.foreign, o.asked, o.offers, o.dropped,
               o.uncounted(), o.commanded, o.commands, o.timeouts, o.ticks, o.skipped, o.missed, o.exit_code,
               o.problem.empty() ? o.causes : o.problem});
  return {.tables = {table}};
}

}  // namespace solenoid
