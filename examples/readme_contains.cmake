# Fails unless the page README quotes the whole file SOURCE.
file(READ ${README} readme)
file(READ ${SOURCE} source)
string(FIND "${readme}" "${source}" at)
if(at EQUAL -1)
  message(FATAL_ERROR "${README} does not quote ${SOURCE} unchanged")
endif()
