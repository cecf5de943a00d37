# Completion of solenoid in bash, also of ./solenoid in a clone. What can stand at the cursor is asked of the program, so that
# this file never says anything else than its --help.

# The words before and at the cursor, with what bash took apart at "=" put together again, as `words`.
_solenoid_words() {
  local i word glue=
  words=()
  for ((i = 1; i <= COMP_CWORD; ++i)); do
    word=${COMP_WORDS[i]}
    if [[ ${#words[@]} -gt 0 && (-n $glue || ($word == = && ${words[-1]} == --*)) ]]; then
      words[-1]+=$word
    else
      words+=("$word")
    fi
    glue=
    [[ $word != = ]] || glue=yes
  done
}

_solenoid() {
  local cur=${COMP_WORDS[COMP_CWORD]} program=${1/#\~/$HOME} words line path
  [[ $cur != = ]] || cur=
  _solenoid_words
  COMPREPLY=()
  while IFS= read -r line; do
    case $line in
      ':folders')
        compopt -o filenames 2>/dev/null
        mapfile -t -O "${#COMPREPLY[@]}" COMPREPLY < <(compgen -d -- "$cur")
        ;;
      ':files '*)
        compopt -o filenames 2>/dev/null
        while IFS= read -r path; do
          [[ $path != *"${line#:files }" && ! -d $path ]] || COMPREPLY+=("$path")
        done < <(compgen -f -- "$cur")
        ;;
      *) COMPREPLY+=("$line") ;;
    esac
  done < <("$program" complete -- "${words[@]}" 2>/dev/null)
}

complete -F _solenoid solenoid
