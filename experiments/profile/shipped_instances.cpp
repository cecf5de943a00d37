#include "experiments/profile/shipped_instances.hpp"

// The assembler copies the file in: a compiler would need minutes for an array of this size.
asm(R"(
.pushsection .rodata
.balign 16
solenoid_shipped_instances_begin:
.incbin ")" SOLENOID_SHIPPED_INSTANCES R"("
solenoid_shipped_instances_end:
.byte 0
.popsection
)");

extern const char shipped_begin[] asm("solenoid_shipped_instances_begin");
extern const char shipped_end[] asm("solenoid_shipped_instances_end");

namespace solenoid {

std::string_view shipped_instance_bytes() {
  return {shipped_begin, static_cast<std::size_t>(shipped_end - shipped_begin)};
}

}  // namespace solenoid
