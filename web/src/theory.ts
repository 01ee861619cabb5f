// The page of the theory: the style and the theme of the laboratory.

import { byId } from "./ui/element";
import { themeButton } from "./ui/theme";
import "./style.css";

themeButton(byId("theme"));
