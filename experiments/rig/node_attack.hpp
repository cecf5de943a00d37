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
  double per_s = 0.0;                     ///< so many a second, while it lasted
  std::int64_t forwarded = 0;             ///< packets of the controller's own
  std::int64_t commanded = 0;             ///< commands among them
  std::int64_t packets = 0, dropped = 0;  ///< that came to the node; that the system had no room for
  std::int64_t invalid = 0, old = 0, foreign = 0, asked = 0, offers = 0;  ///< how the node counted them
  std::int64_t commands = 0, refused = 0, timeouts = 0;                   ///< of the node
  std::int64_t ticks = 0, skipped = 0, expected_ticks = 0, missed = 0;    ///< of the controller; reads without a sample
  std::string causes;                                                     ///< of SAFE
  std::string problem;                                                    ///< why there is no more to tell
  /// Commands the node obeyed that its controller did not send.
  std::int64_t of_others() const { return commands > commanded ? commands - commanded : 0; }
  /// Packets that nobody counted.
  std::int64_t uncounted() const { return sent + forwarded - packets - dropped; }
};

/// How the node is attacked.
struct AttackSettings {
  std::string program;  ///< this program's file
  std::string folder;   ///< for what the runs write
  std::string variant = "nine_state";
  double per_s = 20'000;  ///< packets a second
  double seconds = 2.0;   ///< each attack
};

/// Each kind of attack, by an attacker who sits on the wire (all packets go past it) and can send from the controller's own
/// address as well as from another: open, replay, flood, forged CRC, forged tag, another session. The node is an emulator
/// with a key on 127.0.0.1, nothing else is attacked. Throws OutputError.
std::vector<AttackOutcome> attack_node(const AttackSettings& settings);

/// Whether it was to no avail, and all of it is counted.
bool withstood(const AttackOutcome& outcome);

Result result_of(const std::vector<AttackOutcome>& attacks);

}  // namespace solenoid
