/** For pages that load jsPsych by a script: what the plugin takes from it. */
export const { ParameterType } = globalThis.jsPsychModule;
