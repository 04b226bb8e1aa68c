# Completion of skillcrew, written by `skillcrew completion`. Nothing is run while you type but this.

@TABLES@

_skillcrew_options() {
    local place
    _skillcrew_at "${COMP_WORDS[1]}"
    for place in 2 3; do
        _skillcrew_at "${COMP_WORDS[1]} $place ${COMP_WORDS[place]}"
    done
}

_skillcrew_files() {
    local name
    compopt -o filenames 2>/dev/null
    while IFS= read -r name; do COMPREPLY+=("$name"); done < <(compgen "$1" -- "$2")
}

_skillcrew() {
    local current="${COMP_WORDS[COMP_CWORD]}" before="${COMP_WORDS[COMP_CWORD - 1]}" offered= begun=
    COMPREPLY=()
    # Bash takes --option=value for three words.
    if [[ $current == "=" ]]; then current=; fi
    if [[ $before == "=" ]]; then before="${COMP_WORDS[COMP_CWORD - 2]}"; fi
    if [[ $before == --* ]]; then offered=$(_skillcrew_value "$before"); else offered=@flag; fi
    if [[ $offered == @flag ]]; then
        offered=
        if [[ $current != -* ]]; then offered=$(_skillcrew_place "${COMP_WORDS[1]} $COMP_CWORD"); fi
        if ((COMP_CWORD == 1)); then offered=$(_skillcrew_place commands); fi
        if [[ -z $offered ]]; then offered=$(_skillcrew_options); fi
    fi
    case "$offered" in
        @folder) _skillcrew_files -d "$current" ;;
        @file) _skillcrew_files -f "$current" ;;
        *)
            if [[ $offered == @list* ]]; then
                offered=${offered#@list}
                if [[ $current == *,* ]]; then begun="${current%,*},"; fi
            fi
            COMPREPLY=($(compgen -P "$begun" -W "$offered" -- "${current#"$begun"}"))
            # What a user's own world is called may be a file.
            if [[ -z ${COMPREPLY[*]} && -n $current && $current != -* ]]; then _skillcrew_files -f "$current"; fi
            ;;
    esac
}

# Zsh narrows words down itself, after this, and looks for files where none is left.
if [[ -n $ZSH_VERSION ]]; then
    complete -o default -F _skillcrew skillcrew
else
    complete -F _skillcrew skillcrew
fi
