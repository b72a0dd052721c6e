// What the demo page tells the tests (`www/page.js`), and the names under which it imports the package.
interface Window {
  tetralodDemo: any;
}
