# The target `docs`: the documentation as one site, in the build folder. `./solenoid docs` installs the tools and builds the
# same in build/docs, without configuring anything.
find_program(PYTHON3 python3)
if(PYTHON3)
  add_custom_target(docs COMMAND ${PYTHON3} ${PROJECT_SOURCE_DIR}/docs/site/build.py --out ${PROJECT_BINARY_DIR}/docs
                    USES_TERMINAL VERBATIM)
endif()
