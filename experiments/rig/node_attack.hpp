#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace solenoid {

struct Result;

/// Who has no key, attacks a node on this computer, and what came of it: one kind of attack a row, in the midst of a run of a
/// controller that has the key.
struct AttackOutcome {
  std::string name;
  int exit_code = 0, node_exit_code = 0;  ///< of `run` and `emulator`
  std::int64_t sent = 0;                  ///< packets of the attacker's
  std::int64_t no_packets = 0;            ///< among them, those that have no right tag
  double per_s = 0.0;                     ///< so many a second, while it lasted
  std::int64_t forwarded = 0;             ///< packets of the controller's own
  std::int64_t commanded = 0;             ///< commands among them
  std::int64_t packets = 0, dropped = 0;  ///< that came to the node; that the system had no room for
  std::int64_t counted = 0;               ///< by the node, each in one of its counters
  std::int64_t invalid = 0, old = 0, foreign = 0, asked = 0, offers = 0;  ///< some of those
  std::int64_t sessions = 0, commands = 0, refused = 0, timeouts = 0;     ///< of the node
  std::int64_t ticks = 0, skipped = 0, expected_ticks = 0, missed = 0;    ///< of the controller; reads without a sample
  std::string causes;                                                     ///< of SAFE
  std::string problem;                                                    ///< why there is no more to tell

  /// Commands of the controller that the node did not obey; negative: it obeyed others.
  std::int64_t not_obeyed() const { return commanded - commands; }
  /// Packets that nobody counted.
  std::int64_t uncounted() const { return sent + forwarded - counted - dropped; }
};

/// How the node is attacked.
struct AttackSettings {
  std::string program;  ///< this program's file
  std::string folder;   ///< for what the runs write
  std::string variant = "nine_state";
  bool keyed = true;      ///< without a key the attacker, who is on the wire, gets through: what the table must show
  double per_s = 20'000;  ///< packets a second
  double seconds = 2.0;   ///< each attack
  std::string only{};     ///< one of them by its name; empty: all
};

/// Each kind of attack, by an attacker who sits on the wire (all packets go past it) and can send from the controller's own
/// address as well as from another: open, replay, flood, forged CRC, forged tag, another session. The node is an emulator
/// with a key on 127.0.0.1, nothing else is attacked. Throws OutputError.
std::vector<AttackOutcome> attack_node(const AttackSettings& settings);

/// Whether it was to no avail: every command that the controller sent was obeyed but for what the system dropped, what has no
/// right tag was found to have none, and every packet is counted.
bool withstood(const AttackOutcome& outcome);

Result result_of(const std::vector<AttackOutcome>& attacks);

}  // namespace solenoid
