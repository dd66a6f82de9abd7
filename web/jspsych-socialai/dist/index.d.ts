export default class JsPsychSocialai {
    static info: {
        readonly name: "socialai";
        readonly version: string;
        readonly parameters: {
            /** Address of the study's server, such as `https://study.example.org`. */
            readonly server: {
                readonly type: ParameterType.STRING;
                readonly default: undefined;
            };
            /** Whether the participant has agreed to take part on this page; nobody plays who has not. */
            readonly consented: {
                readonly type: ParameterType.BOOL;
                readonly default: undefined;
            };
            /** By which the participant is known again; without one only this window knows them again. */
            readonly participant: {
                readonly type: ParameterType.STRING;
                readonly default: null;
            };
            /** Milliseconds that the server may be silent, after which the trial ends. */
            readonly connection_timeout: {
                readonly type: ParameterType.INT;
                readonly default: 60000;
            };
        };
        readonly data: {
            /** `played`; `before` if it was played before this page was loaded; `over` if the study has no episode left; `failed`. */
            readonly status: {
                readonly type: ParameterType.STRING;
            };
            /** Why it failed, as a word. */ readonly error: {
                readonly type: ParameterType.STRING;
            };
            /** The same as the page said it. */ readonly message: {
                readonly type: ParameterType.STRING;
            };
            /** Whether nobody sat there. */ readonly simulated: {
                readonly type: ParameterType.BOOL;
            };
            /** Id in the tables of the study. */ readonly participant: {
                readonly type: ParameterType.STRING;
            };
            /** Likewise; those who play together have the same. */ readonly game: {
                readonly type: ParameterType.STRING;
            };
            /** Place of the block in the participant's order, from 1; 0 of practice. */ readonly position: {
                readonly type: ParameterType.INT;
            };
            /** Episode in the block or round, from 1. */ readonly trial: {
                readonly type: ParameterType.INT;
            };
            /** How many the block or round has. */ readonly trials: {
                readonly type: ParameterType.INT;
            };
            /** Episode in the study, with practice, from 1. */ readonly episode: {
                readonly type: ParameterType.INT;
            };
            /** Whether the study has another one for the participant. */ readonly more: {
                readonly type: ParameterType.BOOL;
            };
            /** Steps of the episode. */ readonly steps: {
                readonly type: ParameterType.INT;
            };
            /** Steps that the participant chose. */ readonly own_steps: {
                readonly type: ParameterType.INT;
            };
            /** Whether it was a success; null where the study does not tell. */ readonly success: {
                readonly type: ParameterType.BOOL;
            };
            /** The scenario's own name of the ending, likewise. */ readonly outcome: {
                readonly type: ParameterType.STRING;
            };
            /** Sum of the seat's rewards, likewise. */ readonly return: {
                readonly type: ParameterType.FLOAT;
            };
            /** What was done in each step. */ readonly acts: {
                readonly type: ParameterType.COMPLEX;
                readonly array: true;
                readonly nested: {
                    /** Step of the episode, from 1. */ step: {
                        type: ParameterType;
                    };
                    /** `person`, or who played the step instead. */ by: {
                        type: ParameterType;
                    };
                    /** What was done; empty for standing still. */ movement: {
                        type: ParameterType;
                    };
                    /** What was said. */ said: {
                        type: ParameterType;
                    };
                    /** Lines that the seat heard in the step, one behind another. */ heard: {
                        type: ParameterType;
                    };
                    /** When the picture was shown, milliseconds of the page's clock, which begins with each page. */ shown_ms: {
                        type: ParameterType;
                    };
                    /** When the act was chosen, by the same clock. */ acted_ms: {
                        type: ParameterType;
                    };
                    /** `acted_ms - shown_ms`. */ reaction_ms: {
                        type: ParameterType;
                    };
                    /** Which of the participant's pages it was, from 1. */ connection: {
                        type: ParameterType;
                    };
                    /** When the server took the step, UTC. */ time: {
                        type: ParameterType;
                    };
                };
            };
        };
    };
    /** @param {JsPsych} jsPsych */
    constructor(jsPsych: JsPsych);
    jsPsych: import("jspsych").JsPsych;
    /** @param {HTMLElement} display_element @param {Trial} trial */
    trial(display_element: HTMLElement, trial: Trial): void;
    /** @param {HTMLElement} display @param {Trial} trial @param {(data: Record<string, any>) => void} finish
     * @param {(root: ParentNode) => void} [react] simulates the participant */
    play(display: HTMLElement, trial: Trial, finish: (data: Record<string, any>) => void, react?: (root: ParentNode) => void): void;
    /** @param {Trial} trial @param {"data-only" | "visual"} mode @param {Record<string, any>} options @param {() => void} on_load */
    simulate(trial: Trial, mode: "data-only" | "visual", options: Record<string, any>, on_load: () => void): void;
    pause(): number;
    /** Press something that can be pressed. @param {ParentNode} root */
    react(root: ParentNode): void;
    /** Data of an episode that was never played: no server is asked. */
    made(): {
        status: string;
        participant: null;
        game: null;
        position: null;
        trial: null;
        trials: null;
        episode: null;
        more: null;
        steps: number;
        own_steps: number;
        success: boolean;
        outcome: string;
        return: number;
        acts: {
            step: number;
            by: string;
            movement: string;
            said: string;
            heard: string;
            shown_ms: number;
            acted_ms: number;
            reaction_ms: number;
            connection: number;
            time: null;
        }[];
    };
}
export type JsPsych = import("jspsych").JsPsych;
/**
 * as jsPsych has
 * it when it begins: with what is given by default
 */
export type Trial = {
    server: string;
    consented: boolean;
    participant: string | null;
    connection_timeout: number;
};
import { ParameterType } from "jspsych";
