# Runs the counting image under QEMU, each instruction a nanosecond, and prints what it says.
execute_process(COMMAND ${QEMU} -M mps2-an385 -icount shift=0 -semihosting -nodefaults -nographic -monitor none -net none
                        -serial stdio -kernel ${IMAGE}
                TIMEOUT 60 RESULT_VARIABLE code OUTPUT_VARIABLE said ERROR_VARIABLE problem)
string(REGEX MATCHALL "[0-9]+\n" numbers "${said}")
list(LENGTH numbers count)
if(NOT code EQUAL 0 OR NOT count EQUAL 10 OR said MATCHES "no session")
  message(FATAL_ERROR "The counting image failed (${code}): ${said}${problem}")
endif()
file(WRITE ${OUT} "${said}")
string(REPLACE "\n" "\n  " said "${said}")
message("node image: instructions of a Cortex-M3 (1 cycle each, 2 a load, 2 to 4 a branch that is taken: Arm DDI 0337, 18.2)\n  ${said}")
